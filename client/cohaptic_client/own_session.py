"""Records one client to a session file, for `cohaptic touch --record NAME.mcap`.

The file begins when the server has let the client in and its clock is known, since all times of a
session are on the server's clock.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from pathlib import Path

from cohaptic import __version__
from cohaptic.errors import CohapticError, OutputError, SettingError
from cohaptic.protocol.version import PROTOCOL_VERSION
from cohaptic.sessions.entries import Joined, Link, Rows, RowsLost, SessionInfo
from cohaptic.sessions.recorder import SessionRecorder
from cohaptic.status.row import ROW, columns_with
from cohaptic_client.client import Client
from cohaptic_client.loop.added import reasons_of
from cohaptic_client.network.conversation import greeting

# Bytes of rows that wait for the clock at most: half a minute at 1 kHz.
_WAITING = 30_000 * ROW.size
_LINK = 1.0  # s between two records of the link


class OwnSession:
    """The session file of one client.

    Args:
        path: Path of the file, which must not exist.
        tell: Function that shows a piece of news to the user.
        tell_aside: The same, for other threads.

    Raises:
        SettingError: There is a file of that name.

    Attributes:
        client: The client that is recorded; None before it is made.
    """

    def __init__(
        self, path: Path, tell: Callable[[str], None], tell_aside: Callable[[str], None]
    ) -> None:
        self.client: Client | None = None
        self._path, self._tell, self._tell_aside = path, tell, tell_aside
        self._recorder: SessionRecorder | None = None
        self._waiting = bytearray()
        self._user = 0
        self._linked = -math.inf
        self._dropped = self._lost = 0  # rows: those dropped here, and all that the file says
        self._trouble: CohapticError | None = None
        if path.exists():
            raise SettingError("--record", path, "a file that does not exist yet")

    def keep(self, rows: bytes) -> None:
        """Record rows of the client's loop."""
        if self.client is None:
            return
        if self._trouble is not None:
            return
        try:
            self._keep(self.client, rows)
        except CohapticError as error:  # the hand goes on
            self._trouble = error
            self._tell(f"nothing is recorded: {error}")

    def _keep(self, client: Client, rows: bytes) -> None:
        self._waiting += rows
        excess = max(0, len(self._waiting) - _WAITING)
        del self._waiting[:excess]
        self._dropped += excess // ROW.size
        clocks, user, body = client.clocks(), client.user, client.body
        if user is None or body is None or math.isnan(clocks.to_server):
            return  # on the way to a server
        now = clocks.t + clocks.to_server
        if self._recorder is None:
            info = SessionInfo(
                now, __version__, PROTOCOL_VERSION, "", body.model_dump(mode="json"),
                client.simulation_period, clocks.server_to_wall, {"client": True},
            )  # fmt: skip
            self._recorder = SessionRecorder(self._path, info, tell=self._tell_aside)
        settings = client.settings
        if user != self._user:
            self._user = user
            hello = greeting(settings).model_dump(mode="json")
            self._recorder.add(Joined(now, user, settings.name, hello, settings.force_limit))
        block, self._waiting = bytes(self._waiting), bytearray()
        (t, *_) = ROW.unpack_from(block)
        columns = columns_with(tuple(reasons_of(settings.rules)))
        to_server, error = clocks.to_server, clocks.error
        self._recorder.add(Rows(t + to_server, user, columns, block, to_server, error))
        # Of the loop's memory, and of those that waited for a server.
        if (lost := client.lost_rows + self._dropped) > self._lost:
            self._recorder.add(RowsLost(t + to_server, user, lost - self._lost))
            self._lost = lost
        if now >= self._linked + _LINK:
            self._linked, timing = now, client.timing
            link = Link(now, user, timing.round_trip, timing.jitter, to_server, error)
            self._recorder.add(link)

    async def finish(self) -> OutputError | None:
        """Finish the recording, and say what was recorded; return what has gone wrong with it."""
        if self._trouble is not None:
            return OutputError(self._path, f"nothing was recorded: {self._trouble}")
        if self._recorder is None:
            problem = "nothing was recorded: the hand was never there; no file was made"
            return OutputError(self._path, problem)
        try:
            self._tell(await asyncio.to_thread(self._recorder.finish))
        except OutputError as lost:
            return lost
        return None
