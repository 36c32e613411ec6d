"""Reports of a SpaceMouse: bytes of a report in, deflections of its cap in the world frame out.

Pure functions; `spacemouse.py` makes motion from the deflections. The raw axes point right, toward
the user and down; those of cohaptic point right, away from the user and up.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from cohaptic.vec import Vec3

FULL_SCALE = 350  # counts; logical maximum in the report descriptors, which some units exceed
DEAD_BAND = 0.03  # share of full scale; an untouched cap may rest a few counts off zero

_TRANSLATION, _ROTATION, _BUTTONS = 1, 2, 3  # report ids
_SHORT = 7  # bytes: id and three int16
_LONG = 13  # bytes: id and six int16


@dataclass(frozen=True, slots=True)
class Motion:
    """Deflection of the cap in one report.

    Args:
        translation: Deflection along x, y, z of the world, each -1 to 1 of full scale; None if not
            reported.
        rotation: Deflection about x, y, z of the world, each -1 to 1 of full scale; None if not
            reported.
    """

    translation: Vec3 | None
    rotation: Vec3 | None


@dataclass(frozen=True, slots=True)
class Buttons:
    """The buttons that are down.

    Args:
        pressed: One bit for each button; bit b of byte n of the report is bit 8 (n - 1) + b.
    """

    pressed: int


def decode(report: Iterable[int]) -> Motion | Buttons | None:
    """Decode a report; returns None for a report that is unknown, truncated or not made of bytes.

    Older devices send translation and rotation as two reports, newer devices send both in one long
    report. The length tells them apart; a list of product ids would lack those of future devices.
    """
    try:
        data = bytes(report)
    except ValueError:  # a number that is not a byte
        return None
    kind = data[0] if data else None
    if kind == _TRANSLATION and len(data) >= _LONG:
        return Motion(_deflection(data, 1), _deflection(data, 7))
    if kind == _TRANSLATION and len(data) >= _SHORT:
        return Motion(_deflection(data, 1), None)
    if kind == _ROTATION and len(data) >= _SHORT:
        return Motion(None, _deflection(data, 1))
    if kind == _BUTTONS and len(data) >= 2:
        return Buttons(int.from_bytes(data[1:], "little"))
    return None


def without_dead_band(deflection: Vec3) -> Vec3:
    """Deflection that is 0 within `DEAD_BAND` of zero on each axis, then linear to full scale."""
    x, y, z = deflection
    return (_rescale(x), _rescale(y), _rescale(z))


def _rescale(value: float) -> float:
    beyond = abs(value) - DEAD_BAND
    return math.copysign(beyond / (1.0 - DEAD_BAND), value) if beyond > 0.0 else 0.0


def _deflection(data: bytes, start: int) -> Vec3:
    x, y, z = (
        int.from_bytes(data[i : i + 2], "little", signed=True) for i in range(start, start + 6, 2)
    )
    return (_share(x), _share(-y), _share(-z))


def _share(counts: int) -> float:
    return max(-1.0, min(1.0, counts / FULL_SCALE))
