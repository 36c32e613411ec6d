"""Radius, gear, sensor and motor of one particular handle, from a file.

The default lengths are roughly those of a Hapkit and only a start: `counts_per_metre` of a
calibration replaces them. A wrong torque constant scales every force, and with a wrong direction a
spring pushes the hand on and on, so without a file there is no force.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from typing import Any

from cohaptic.errors import SettingError
from cohaptic_drivers.unit_file import read_unit_file

_LONGEST = 10_000  # bytes of a unit's file; a full one has 400


@dataclass(frozen=True, slots=True)
class Unit:
    """A handle on one motor.

    Args:
        handle_radius: Distance from the handle's axis to the point where the hand holds it [m].
        gear: Turns of the motor for one turn of the handle: drum over capstan.
        counts_per_metre: Counts of the sensor per metre of the handle's arc; 0 to compute them from
            radius, gear and the counts per turn that the board reports.
        sensor_direction: 1 if counts grow as the handle goes away from the user, else -1.
        motor_direction: 1 if a positive current moves the handle away from the user, else -1.
        torque_constant: Torque constant of the motor [N m/A]; 0 if it is unknown, and then there is
            no force.
        friction: Friction of handle and motor, as the hand feels it [N].
        damping: Damping of handle and motor, as the hand feels it [N s/m].
        max_current: Largest current through the motor [A]; the board's own limit holds as well.
        max_force: Largest force at the handle [N].
        max_stiffness: Largest stiffness that the handle renders stably [N/m].
        max_damping: Largest damping that the handle renders stably [N s/m].
        travel: Largest distance of the handle from its middle [m].
    """

    handle_radius: float = 0.0657
    gear: float = 17.45
    counts_per_metre: float = 0.0
    sensor_direction: float = 1.0
    motor_direction: float = 1.0
    torque_constant: float = 0.0
    friction: float = 0.0
    damping: float = 0.0
    max_current: float = 0.5
    max_force: float = 3.0
    max_stiffness: float = 300.0
    max_damping: float = 2.0
    travel: float = 0.08

    def counts(self, per_turn: int) -> float:
        """Return the counts per metre of the handle's arc.

        Args:
            per_turn: Counts per turn of the motor, as the board reports them.
        """
        reported = self.counts_per_metre
        return reported or per_turn * self.gear / (2.0 * math.pi * self.handle_radius)

    def current(self, force: float) -> float:
        """Return the current [A] for a force [N] away from the user; 0 without torque constant."""
        if self.torque_constant == 0.0:
            return 0.0
        torque = force * self.handle_radius / self.gear
        wanted = self.motor_direction * torque / self.torque_constant
        return max(-self.max_current, min(self.max_current, wanted))

    def most_force(self, board_limit: float) -> float:
        """Return the largest force [N] on a board that gives at most `board_limit` [A]."""
        ampere = min(self.max_current, board_limit)
        return min(self.max_force, ampere * self.torque_constant * self.gear / self.handle_radius)


# Lowest and highest value for each key of the file. A direction has one of these two values.
_LIMITS = {
    "handle_radius": (0.01, 0.5),
    "gear": (0.1, 200.0),
    "counts_per_metre": (100.0, 1e7),
    "sensor_direction": (-1.0, 1.0),
    "motor_direction": (-1.0, 1.0),
    "torque_constant": (1e-4, 1.0),
    "friction": (0.0, 10.0),
    "damping": (0.0, 100.0),
    "max_current": (0.01, 10.0),
    "max_force": (0.1, 30.0),
    "max_stiffness": (10.0, 1e4),
    "max_damping": (0.01, 100.0),
    "travel": (0.005, 0.5),
}
_DIRECTIONS = ("sensor_direction", "motor_direction")
# These keys have no usual value: a wrong one makes a spring push on and on, or scales every force.
_NEEDED = (*_DIRECTIONS, "torque_constant")
assert set(_LIMITS) == {each.name for each in fields(Unit)}


def read_unit(path: str) -> Unit:
    """Read the unit from its file; without a path, return a unit that only senses.

    Raises:
        SettingError: The file cannot be read, lacks a key, or has an unknown key or invalid value.
    """
    if not path:
        return Unit()
    raw = read_unit_file(path, _LONGEST)
    values = {key: _value(key, raw[key], path) for key in raw}
    missing = [key for key in _NEEDED if key not in raw]
    if missing:
        raise SettingError(f"{missing[0]} in {path}", "missing", "told: a force needs it")
    return replace(Unit(), **values)


def _value(key: str, value: Any, path: str) -> float:
    if key not in _LIMITS:
        raise SettingError(f"key of {path}", repr(key), f"one of: {', '.join(_LIMITS)}")
    low, high = _LIMITS[key]
    name, limit = f"{key} in {path}", f"a number from {low:g} to {high:g}"
    if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
        raise SettingError(name, value, limit)
    if key in _DIRECTIONS and abs(value) != 1.0:
        raise SettingError(name, value, "1 or -1")
    return float(value)
