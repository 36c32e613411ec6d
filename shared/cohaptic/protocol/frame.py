"""Common parts of the binary frames: the header, and checks of the values that are sent.

A frame is little-endian and packed: `u8 version, u8 kind, u16 flags`, then the body of its kind.
"""

from __future__ import annotations

import math
from typing import Final

from cohaptic.errors import (
    CloseCode,
    LocalProtocolError,
    ProtocolError,
    RemoteProtocolError,
)
from cohaptic.protocol.fields import HEAD, FrameKind
from cohaptic.protocol.version import PROTOCOL_VERSION
from cohaptic.vec import Vec3, norm

# Largest frame sent at the simulation rate, except for mesh patches.
MAX_FRAME_BYTES: Final = 140
# Of a mesh patch. Without partners it has 1,120 bytes at most: with headers below the 1,280 bytes
# that every network path carries. Seven partners take 388 more.
MAX_MESH_FRAME_BYTES: Final = 1536
MAX_POSITION: Final = 10.0  # m; no user's workspace reaches further from the body
MAX_FORCE: Final = 100.0  # N; several times the largest force of any haptic device
HEADER: Final = HEAD.packer()


def open_header(data: bytes, kind: FrameKind) -> int:
    """Check version and kind of a frame; returns its flags.

    Raises:
        RemoteProtocolError: The frame is too short, or its version or kind is wrong; the error
            names the value found and the expected one.
    """
    if len(data) < HEADER.size:
        raise RemoteProtocolError(
            "frame length", len(data), f"at least {HEADER.size} bytes", field="length"
        )
    version, got, flags = HEADER.unpack_from(data)
    if version != PROTOCOL_VERSION:
        raise RemoteProtocolError(
            "frame's protocol version",
            version,
            str(PROTOCOL_VERSION),
            CloseCode.WRONG_VERSION,
            "version",
        )
    if got != kind:
        raise RemoteProtocolError(
            "frame kind", got, f"{kind.value} ({kind.name.lower()})", field="kind"
        )
    return int(flags)


def open_frame(data: bytes, kind: FrameKind, size: int) -> int:
    """Check version, kind and length of a frame; returns its flags.

    Raises:
        RemoteProtocolError: As `open_header`, or the length is not `size` bytes.
    """
    flags = open_header(data, kind)
    if len(data) != size:
        raise RemoteProtocolError(
            f"{kind.name.lower()} length", len(data), f"{size} bytes", field="length"
        )
    return flags


def check_finite(name: str, *values: float, remote: bool) -> None:
    """Raise unless every value is a finite number."""
    for value in values:
        if not math.isfinite(value):
            raise _error(remote)(name, value, "a finite number")


def check_vector(name: str, value: Vec3, limit: float, unit: str, *, remote: bool) -> None:
    """Raise unless `value` is finite and no longer than `limit`."""
    # One comparison accepts every valid value; a NaN fails it.
    if not norm(value) <= limit:
        check_finite(name, *value, remote=remote)
        found, largest = f"{norm(value):.4g} {unit}", f"<= {limit} {unit}"
        raise _error(remote)(f"length of {name}", found, largest, field=name.partition(" of ")[0])


def wrong(name: str, value: object, limit: str, *, remote: bool) -> ProtocolError:
    """The error for a value that breaks the protocol, sent by the peer (`remote`) or by us."""
    return _error(remote)(name, value, limit)


def check_range(name: str, value: float, low: float, high: float, *, remote: bool) -> None:
    """Raise unless low <= value <= high; NaN raises too."""
    if not low <= value <= high:
        raise _error(remote)(name, value, f"from {low:g} to {high:g}")


def _error(remote: bool) -> type[LocalProtocolError] | type[RemoteProtocolError]:
    return RemoteProtocolError if remote else LocalProtocolError
