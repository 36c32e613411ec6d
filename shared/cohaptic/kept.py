"""Keep the recording of a room on this machine.

The work is the client's (`cohaptic_client/scripting/recording.py`), which an entry point names,
since this package imports no client.
"""

from __future__ import annotations

from contextlib import AbstractContextManager
from pathlib import Path
from types import FunctionType
from typing import Protocol

from cohaptic.extensions import load


class HasUrl(Protocol):
    """A room that this program serves, as [`serve`][cohaptic_server.serve] makes it."""

    @property
    def url(self) -> str:
        """Address for clients."""
        ...


class RoomRecording(Protocol):
    """A recording in progress; [`record`][cohaptic.record] makes it."""

    @property
    def path(self) -> Path:
        """Path of the file."""
        ...

    @property
    def recording(self) -> bool:
        """Whether the session is still recorded; the end of the block says why it is not."""
        ...

    def mark(self, text: str, **fields: str | float | bool | None) -> None:
        """Set a mark in the recording, with the time of this call.

        Args:
            text: What it says, up to 200 characters.
            fields: Up to 16 further values: texts, numbers, booleans or None.

        Raises:
            SettingError: A value is out of its limits.
            CohapticError: The recording has ended.
        """
        ...


def record(
    path: str | Path,
    room: str | HasUrl,
    *,
    token: str = "",
    ca_file: str = "",
    insecure: bool = False,
) -> AbstractContextManager[RoomRecording]:
    """Record a room while a block runs: `with cohaptic.record("s01", room) as recording:`.

    The file is on this machine, and everybody in the room is told. It has what the server hears and
    answers, and every haptic period of the clients that send their rows, as `cohaptic touch` and
    hands of scripts do.

    Args:
        path: Session file (`.mcap`) that does not exist yet, or a folder in which it gets a name.
        room: Address of the room, the link of an invitation, or a room that this program serves.
        token: Token that may record (`cohaptic token --record`). A server without access control
            lets programs of its own machine record.
        ca_file: File with the certificates to trust; empty for the system's certificates.
        insecure: Whether to send a token without TLS.

    Raises:
        SettingError: The file exists or cannot be made.
        ServerLost: No server answers, or the connection was lost; the file has what came until
            then.
        CohapticError: The server does not let this program record, or something else records the
            session.
    """
    keep = load("cohaptic.scripting", "record", FunctionType)
    url = room if isinstance(room, str) else room.url
    kept: AbstractContextManager[RoomRecording] = keep(
        path, url, token=token, ca_file=ca_file, insecure=insecure
    )
    return kept
