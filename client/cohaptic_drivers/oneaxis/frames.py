"""Pure functions for the messages between a one-axis board and its host: frames with a checksum.

The protocol is our own (`docs/reference/one-axis-board.md`). The board's side is
`examples/one_axis_board/axis_core.c`, and the tests run this module against it.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass

NAME = "oneaxis"
VERSION = 1

_SYNC = 0xC5
_IDENTIFY, _FORCE, _DESCRIPTION, _REPORT = b"IFDR"
_MAGIC = b"cohaptic"
_DESCRIBED = struct.Struct(
    "<B8sB5H"
)  # sequence, magic, version, limit, full, watchdog, ramp, counts
_REPORTED = struct.Struct("<BBIih")  # sequence, flags, time, counts, current
_SIZES = {_DESCRIPTION: 3 + _DESCRIBED.size + 1, _REPORT: 3 + _REPORTED.size + 1}
_FAULTY, _TRIPPED, _LIMITED, _PRESSED = 1, 2, 4, 8
_MAX_CURRENT = 32767  # mA; largest number that fits into a frame


@dataclass(frozen=True, slots=True)
class Description:
    """Limits and sensor of a board, as the board states them.

    Args:
        version: Version of the protocol.
        limit: Largest current that the board ever gives the motor [A].
        full: Current of the motor at full voltage while it stands still [A].
        watchdog: Time without a command after which the board switches the motor off [s].
        ramp: Time in which the current limit rises from zero after a start or a silence [s].
        counts: Counts of the sensor per turn of the part that it measures.
    """

    version: int
    limit: float
    full: float
    watchdog: float
    ramp: float
    counts: int


@dataclass(frozen=True, slots=True)
class Report:
    """Answer of a board to a command.

    Args:
        sequence: Sequence number of the command, 0 to 255.
        time: Time on the board's clock, which wraps after 71 minutes [s].
        counts: Counts of the sensor.
        current: Current of the motor [A].
        button: Whether the button is pressed.
        faulty: Whether the sensor failed: there is no current until the board starts again.
        tripped: Whether the board had switched the motor off before this command, for lack of
            commands.
        limited: Whether the current is less than the command asked for.
    """

    sequence: int
    time: float
    counts: int
    current: float
    button: bool = False
    faulty: bool = False
    tripped: bool = False
    limited: bool = False


def identify(sequence: int) -> bytes:
    """Encode a request for the description; it gives no force and does not reset the watchdog."""
    return _sealed(bytes([_IDENTIFY, sequence & 0xFF]))


def command(sequence: int, amperes: float) -> bytes:
    """Encode a motor current [A], positive toward growing counts; 0 if it is not finite."""
    wanted = 1e3 * amperes if math.isfinite(amperes) else 0.0
    milliamperes = round(max(-_MAX_CURRENT, min(_MAX_CURRENT, wanted)))
    return _sealed(struct.pack("<BBh", _FORCE, sequence & 0xFF, milliamperes))


class Reader:
    """Finds frames in the bytes that come from a board.

    Attributes:
        skipped: Number of bytes since the last whole frame that belong to no frame.
    """

    def __init__(self) -> None:
        self._waiting = b""
        self.skipped = 0

    def take(self, data: bytes) -> list[Description | Report]:
        """Return the frames that these bytes complete, in the order in which they came."""
        self._waiting += data
        found: list[Description | Report] = []
        at = 0
        while len(self._waiting) - at > 1:
            size = _SIZES.get(self._waiting[at + 1]) if self._waiting[at] == _SYNC else None
            if size is not None and len(self._waiting) - at < size:
                break
            reported = None if size is None else _read(self._waiting[at : at + size])
            if size is None or reported is None:
                at, self.skipped = at + 1, self.skipped + 1
            else:
                found.append(reported)
                at, self.skipped = at + size, 0
        self._waiting = self._waiting[at:]
        return found


def _read(frame: bytes) -> Description | Report | None:
    """Decode a frame of the right length; return None if its checksum or its magic is wrong."""
    if int.from_bytes(frame[-2:], "little") != crc16(frame[1:-2]):
        return None
    if frame[1] == _DESCRIPTION:
        _, magic, version, limit, full, watchdog, ramp, counts = _DESCRIBED.unpack(frame[2:-2])
        if magic != _MAGIC:
            return None
        return Description(version, 1e-3 * limit, 1e-3 * full, 1e-3 * watchdog, 1e-3 * ramp, counts)
    sequence, flags, time, counts, current = _REPORTED.unpack(frame[2:-2])
    return Report(
        sequence,
        1e-6 * time,
        counts,
        1e-3 * current,
        button=bool(flags & _PRESSED),
        faulty=bool(flags & _FAULTY),
        tripped=bool(flags & _TRIPPED),
        limited=bool(flags & _LIMITED),
    )


def crc16(data: bytes) -> int:
    """Return the checksum CRC-16/CCITT-FALSE: polynomial 0x1021, start 0xFFFF, no bits reversed."""
    crc = 0xFFFF
    for byte in data:
        crc = (crc << 8 & 0xFFFF) ^ _TABLE[crc >> 8 ^ byte]
    return crc


def _entry(index: int) -> int:
    crc = index << 8
    for _ in range(8):
        crc = crc << 1 ^ (0x1021 if crc & 0x8000 else 0)
    return crc & 0xFFFF


_TABLE = tuple(_entry(index) for index in range(256))


def _sealed(body: bytes) -> bytes:
    return bytes([_SYNC]) + body + crc16(body).to_bytes(2, "little")
