"""Pure functions for the position of the tip, which the trigger and the sticks move.

The trigger moves the tip inward. The left stick moves it sideways, up and down; the right stick
moves its starting point toward the object and back. The sticks use rate control, because their own
travel is a centimetre. With the trigger released the tip stays off the object: a tip that the right
stick pushes into the object is moved back.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from cohaptic.vec import ZERO, Vec3
from cohaptic_drivers.dualsense.reports import LARGEST, Held

RELEASED = 5  # of 255; an untouched trigger may rest a little off zero
FASTEST = 0.5  # m/s of the tip by the trigger; a slammed trigger would exceed the limits of a hand
_SMOOTH = 0.004  # s; interval of the pad's reports, between which the tip moves on
_DEAD_BAND = 0.1  # of full scale; an untouched stick rests a few counts off its centre
_AT_REST = 1e-4  # m; a smaller press counts as none; one step of the trigger moves the tip by more
SPEED = 0.15  # m/s of the tip by a stick, along each axis, at full deflection


@dataclass(frozen=True, slots=True)
class Axes:
    """Directions in which trigger and sticks move the tip: unit vectors at right angles.

    Args:
        side: Direction in which a stick to the right moves the tip, in the device's frame.
        up: Direction in which a stick upward moves the tip, in the device's frame.
        inward: Direction in which the trigger moves the tip, in the device's frame.
    """

    side: Vec3
    up: Vec3
    inward: Vec3


FRONT = Axes(side=(1.0, 0.0, 0.0), up=(0.0, 0.0, 1.0), inward=(0.0, 1.0, 0.0))
TOP = Axes(side=(1.0, 0.0, 0.0), up=(0.0, 1.0, 0.0), inward=(0.0, 0.0, -1.0))


@dataclass(frozen=True, slots=True)
class Room:
    """Region in which the tip moves, around the object's centre.

    Args:
        axes: Directions of trigger and sticks.
        depth: Motion of the tip over the whole stroke of the trigger [m].
        reach: Largest distance from the centre, along each axis, to which sticks move the tip [m].
    """

    axes: Axes
    depth: float
    reach: float


@dataclass(frozen=True, slots=True)
class Cursor:
    """Position and velocity of the tip, along the axes of the pad.

    Args:
        side: Distance to the right of the object's centre [m].
        up: Distance above the centre [m].
        base: Distance along `inward` from the centre with the trigger released; negative in front
            of the centre [m].
        press: Distance along `inward` from `base`, by the trigger [m].
        blocked: Whether the user has to let the right stick go before it moves the tip inward
            again.
        velocity: Rates of `side`, of `up`, and of `base` and `press` together [m/s].
    """

    side: float = 0.0
    up: float = 0.0
    base: float = 0.0
    press: float = 0.0
    blocked: bool = False
    velocity: Vec3 = ZERO


def moved(cursor: Cursor, held: Held, dt: float, room: Room, *, contact: bool) -> Cursor:
    """Return the cursor after a step of `dt` with sticks and trigger as in `held`.

    Args:
        cursor: Cursor before the step.
        held: State of sticks and trigger.
        dt: Duration of the step [s].
        room: Region in which the tip moves.
        contact: Whether the tip feels a force now.
    """
    side, side_speed = _bounded(cursor.side, _rate(held.left[0]), dt, -room.reach, room.reach)
    up, up_speed = _bounded(cursor.up, _rate(held.left[1]), dt, -room.reach, room.reach)
    rate = _rate(held.right[1])
    # After a quick release of the trigger the tip still follows it, and so leaves the object.
    released = held.pull <= RELEASED and cursor.press <= _AT_REST
    blocked = rate > 0.0 and (cursor.blocked or (contact and released))
    if released and contact:
        rate = -SPEED
    elif contact or blocked:
        rate = min(rate, 0.0)
    base, base_speed = _bounded(cursor.base, rate, dt, -room.reach, 0.0)
    goal = room.depth * max(0, held.pull - RELEASED) / (LARGEST - RELEASED)
    step = (goal - cursor.press) * -math.expm1(-dt / _SMOOTH)
    step = max(-FASTEST * dt, min(FASTEST * dt, step))
    press_speed = step / dt if dt > 0.0 else 0.0
    velocity = (side_speed, up_speed, base_speed + press_speed)
    return Cursor(side, up, base, cursor.press + step, blocked, velocity)


def position(cursor: Cursor, axes: Axes) -> Vec3:
    """Return the position of the tip, in the device's frame [m]."""
    return _along(axes, (cursor.side, cursor.up, cursor.base + cursor.press))


def velocity(cursor: Cursor, axes: Axes) -> Vec3:
    """Return the velocity of the tip, in the device's frame [m/s]."""
    return _along(axes, cursor.velocity)


def pull_of(cursor: Cursor, room: Room) -> int:
    """Return the pull of the trigger that corresponds to the present press, 0 to 255."""
    return round(RELEASED + (LARGEST - RELEASED) * cursor.press / room.depth)


def _along(axes: Axes, v: Vec3) -> Vec3:
    (a, b, c), (u, w, n) = v, (axes.side, axes.up, axes.inward)
    return (
        a * u[0] + b * w[0] + c * n[0],
        a * u[1] + b * w[1] + c * n[1],
        a * u[2] + b * w[2] + c * n[2],
    )


def _rate(stick: float) -> float:
    beyond = abs(stick) - _DEAD_BAND
    return math.copysign(SPEED * beyond / (1.0 - _DEAD_BAND), stick) if beyond > 0.0 else 0.0


def _bounded(place: float, rate: float, dt: float, low: float, high: float) -> tuple[float, float]:
    """Return coordinate [m] and speed [m/s] after `dt` [s]; motion stops at `low` and `high`."""
    after = place + rate * dt
    if after <= low:
        return low, max(0.0, rate)
    if after >= high:
        return high, min(0.0, rate)
    return after, rate
