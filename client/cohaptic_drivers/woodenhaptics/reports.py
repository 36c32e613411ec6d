"""Pure functions for the messages of the boards: lines of the serial, reports of HID boards."""

from __future__ import annotations

import re
import struct
from dataclasses import dataclass

from cohaptic.vec import Vec3

LINE = 16  # bytes; commands are padded to it with NUL, because whole transfers are faster
_FIELDS = 8  # fields of an answer: model, six counts, error
_ANSWER = re.compile(rb"\[(-?\d{1,10}(?:,-?\d{1,10}){7})\]")
_WRIST = 0b111  # error bits of the wrist's sensors, which the tip does not need

# H2 and H3 report a pressed button as a count that no wrist reaches.
_PRESSED = 5000


@dataclass(frozen=True, slots=True)
class Reported:
    """A report of a board.

    Args:
        counts: Counts of the three encoders.
        button: Whether the button is pressed.
        model: Number of the arm's kind; 0 if the board does not know it.
        error: Bits of the errors that the board found in the last command; 0 for none.
    """

    counts: Vec3
    button: bool = False
    model: int = 0
    error: int = 0


def command_line(milliamps: Vec3) -> bytes:
    """Return the line that sends motor currents [mA] to the serial board."""
    a, b, c = (round(each) for each in milliamps)
    return f"[{a},{b},{c}]\n".encode().ljust(LINE, b"\0")


def read_answer(line: bytes) -> Reported | None:
    """Read a line from the serial board; return None if it is not an answer."""
    found = _ANSWER.fullmatch(line.strip(b"\0\r\n "))
    if found is None:
        return None
    model, a, b, c, *_, error = (int(each) for each in found[1].split(b","))
    return Reported((float(a), float(b), float(c)), model=model, error=error & ~_WRIST)


@dataclass(frozen=True, slots=True)
class Reports:
    """Layout of the reports of one generation of HID boards.

    Args:
        name: Name of the generation.
        size: Size of a report, in both directions [bytes].
        waits: Whether the board sends nothing before the host has sent a command.
    """

    name: str
    size: int
    waits: bool

    def decode(self, report: bytes) -> Reported | None:
        """Decode a report; return None for one of another length."""
        if len(report) != self.size:
            return None
        if not self.waits:
            a, b, c, _count = struct.unpack("<4h", report)
            return Reported((a, b, c))
        a, b, c, d, _e, _f, _info = struct.unpack_from("<7h", report)
        return Reported((a, b, c), button=d > _PRESSED)

    def encode(self, milliamps: Vec3) -> bytes:
        """Encode motor currents [mA] as a report, after the 0 that marks an unnumbered report."""
        a, b, c = (round(each) for each in milliamps)
        body = struct.pack("<3h", a, b, c)  # the fields after it are zero: command, attributes
        return b"\0" + body.ljust(self.size, b"\0")


GENERATIONS = {
    "h1": Reports("h1", 8, waits=False),
    "h2": Reports("h2", 14, waits=True),
    "h3": Reports("h3", 64, waits=True),
}


def input_size(descriptor: bytes) -> int:
    """Return the length of an unnumbered input report [bytes]; 0 if the descriptor is cut off.

    Args:
        descriptor: HID report descriptor (HID 1.11, section 6.2.2).
    """
    size = count = bits = at = 0
    while at < len(descriptor):
        head = descriptor[at]
        length = (0, 1, 2, 4)[head & 0b11]
        data = descriptor[at + 1 : at + 1 + length]
        if len(data) < length:
            return 0
        value = int.from_bytes(data, "little")
        kind = head & 0b11111100
        if kind == 0x74:
            size = value
        elif kind == 0x94:
            count = value
        elif kind == 0x80:
            bits += size * count
        at += 1 + length
    return bits // 8
