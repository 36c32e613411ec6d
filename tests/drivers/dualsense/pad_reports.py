"""Reports as a DualSense sends them, and what it makes of those that it gets."""

from __future__ import annotations

from cohaptic_drivers.dualsense.reports import Effects

CENTRE = 128


def pad_report(
    *,
    left: tuple[int, int] = (CENTRE, CENTRE),
    right: tuple[int, int] = (CENTRE, CENTRE),
    l2: int = 0,
    r2: int = 0,
    buttons: tuple[int, int, int] = (8, 0, 0),
) -> bytes:
    """A report of 64 bytes; sticks are right and down from (0, 0)."""
    return bytes([1, *left, *right, l2, r2, 0, *buttons]).ljust(64, b"\0")


def understood(report: bytes, block: int = 11) -> Effects:
    """What the pad does by a report to it, at the trigger whose effect begins at `block`."""
    assert len(report) == 48
    assert report[0] == 0x02
    assert report[1] == 0x03 | {11: 0x04, 22: 0x08}[block]
    assert report[3] == report[4]
    mode, start, resistance = report[block : block + 3]
    assert mode in (0x01, 0x05)
    assert (mode == 0x05) == (resistance == 0)
    # Nothing else is changed.
    assert not any(report[5:block] + report[block + 3 :])
    assert report[2] == 0
    return Effects(start, resistance, report[3])
