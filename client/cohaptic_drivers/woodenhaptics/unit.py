"""Lengths, gears, encoders and motors of one particular arm, from its kind and a file.

The constants of the three kinds are those of the maintainers' host library of 2026. A wrong torque
constant scales every force, and a wrong direction makes a spring push the wrong way, so a file of
the unit overrides them.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any, cast

from cohaptic.errors import SettingError
from cohaptic.vec import Vec3
from cohaptic_drivers.unit_file import read_unit_file

_LONGEST = 10_000  # bytes of a unit's file; a full one has 500


@dataclass(frozen=True, slots=True)
class Unit:
    """An arm with three motors.

    Args:
        kind: Kinematics of the arm: woodenhaptics, vintage or polhem.
        model: Number by which the serial board reports this kind.
        capstans: Diameters of the capstans, on the motors [mm].
        drums: Diameters of the drums, on the driven bodies [mm].
        lengths: Lengths of its links [m]; those of a Polhem are in `kinematics.py`.
        origin: Origin of the workspace, from the base [m]; toward the user, user's right, up.
        counts: Counts of each encoder per turn of its motor.
        home: Counts in the home pose, which are added because the counters are zero there.
        torque_constants: Torque constants of the motors [N m/A].
        directions: Signs of each motor and encoder relative to the driven body, each 1 or -1.
        max_current: Largest current through a motor [A].
        max_force: Largest force at the tip [N].
        max_stiffness: Largest stiffness that the arm renders stably [N/m].
        max_damping: Largest damping that the arm renders stably [N s/m].
        confirmed: Whether the values come from a file for this particular arm.
    """

    kind: str
    model: int
    capstans: Vec3
    drums: Vec3
    lengths: Vec3
    origin: Vec3
    counts: Vec3
    home: Vec3
    torque_constants: Vec3
    directions: Vec3
    max_current: float = 3.0
    max_force: float = 5.0
    max_stiffness: float = 1000.0
    max_damping: float = 8.0
    confirmed: bool = False


# 3 A is the full scale of the older boards, and the motors bear it for a while; the serial board
# gives up to 6 A to a unit whose file allows it.
UNITS = {
    "woodenhaptics": Unit(
        "woodenhaptics", 3, (10.0, 10.0, 10.0), (160.0, 120.0, 120.0), (0.080, 0.205, 0.245),
        (0.220, 0.0, 0.080), (2000.0, 2000.0, 2000.0), (0.0, 0.0, -6000.0),
        (0.0259, 0.0259, 0.0259), (1.0, -1.0, -1.0),
    ),
    "polhem": Unit(
        "polhem", 1, (28.8534, 13.6981, 13.7281), (175.0, 100.0, 100.0), (0.0, 0.0, 0.0),
        (0.2045, 0.0, 0.0325), (4096.0, 4096.0, 4096.0), (8312.0, -10366.0, 19764.0),
        (0.0603, 0.0538, 0.0538), (1.0, -1.0, 1.0), max_stiffness=2000.0, max_damping=1.0,
    ),
    "vintage": Unit(
        "vintage", 2, (13.0, 10.0, 10.0), (117.0, 77.0, 77.0), (0.0, 0.138, 0.112),
        (0.138, 0.0, -0.097), (4000.0, 4000.0, 4000.0), (0.0, 7700.0, 0.0),
        (0.0234, 0.0234, 0.0234), (-1.0, 1.0, -1.0),
    ),
}  # fmt: skip

# Lowest and highest value for each key of the file.
_TRIPLES = {
    "capstans": (1.0, 100.0),
    "drums": (1.0, 1000.0),
    "lengths": (0.0, 1.0),
    "origin": (-1.0, 1.0),
    "counts": (100.0, 1e6),
    "home": (-1e6, 1e6),
    "torque_constants": (1e-3, 1.0),
    "directions": (-1.0, 1.0),
}
# The serial board turns a current above 6 A into zero, so a file may not allow more.
_NUMBERS = {
    "max_current": (0.1, 6.0),
    "max_force": (0.1, 30.0),
    "max_stiffness": (10.0, 1e4),
    "max_damping": (0.1, 100.0),
}


def read_unit(kind: str, path: str) -> Unit:
    """Return the unit of a kind, with the values of a file in place of the usual ones.

    Args:
        kind: Name of the kind, a key of `UNITS`.
        path: Path of the file; empty for none.

    Raises:
        SettingError: The file cannot be read, or has an unknown key or an invalid value.
    """
    unit = UNITS[kind]
    if not path:
        return unit
    raw = read_unit_file(path, _LONGEST)
    return replace(unit, confirmed=True, **{key: _value(key, raw[key], path) for key in raw})


def _value(key: str, value: Any, path: str) -> Any:
    name = f"{key} in {path}"
    if key in _TRIPLES:
        low, high = _TRIPLES[key]
        limit = f"three numbers from {low:g} to {high:g}"
        listed: list[Any] = list(cast(Iterable[Any], value)) if isinstance(value, list) else []
        if len(listed) != 3:
            raise SettingError(name, str(cast(object, value)), limit)
        numbers = [_number(name, each, low, high, limit) for each in listed]
        if key == "directions" and any(abs(each) != 1.0 for each in numbers):
            raise SettingError(name, listed, "three of 1 and -1")
        return tuple(numbers)
    if key in _NUMBERS:
        low, high = _NUMBERS[key]
        return _number(name, value, low, high, f"a number from {low:g} to {high:g}")
    known = ", ".join((*_TRIPLES, *_NUMBERS))
    raise SettingError(f"key of {path}", repr(key), f"one of: {known}")


def _number(name: str, value: Any, low: float, high: float, limit: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
        raise SettingError(name, value, limit)
    return float(value)
