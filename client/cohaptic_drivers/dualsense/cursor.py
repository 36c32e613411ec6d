"""Where the tip is: the trigger moves it inward, the sticks move where it starts from. Pure.

The left stick moves the tip sideways, the right one moves the whole way of the trigger toward the
object and back; both by rate control, as their own travel is a centimetre. With the trigger
released the tip is off the object: one that the right stick pushes into it is moved back.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from cohaptic.vec import ZERO, Vec3
from cohaptic_drivers.dualsense.reports import MOST, Held

RELEASED = 5  # of 255; a trigger that nobody touches may rest a little off zero
FASTEST = 0.5  # m/s of the tip by the trigger: slammed shut it would be a hand that breaks limits
_SMOOTH = 0.004  # s; the pad tells of its trigger as often, and the tip goes on in between
_DEAD_BAND = 0.1  # of full scale; a stick that nobody touches rests a few counts off its centre
_AT_REST = 1e-4  # m; of the press; less than the tip goes for one step of the trigger
SPEED = 0.15  # m/s of the tip by a stick, along each axis, at full deflection


@dataclass(frozen=True, slots=True)
class Axes:
    """How trigger and sticks lie in the device's frame: unit vectors at right angles.

    Args:
        side: Direction of a stick to the right.
        up: Direction of a stick upward.
        inward: Direction of the trigger.
    """

    side: Vec3
    up: Vec3
    inward: Vec3


FRONT = Axes(side=(1.0, 0.0, 0.0), up=(0.0, 0.0, 1.0), inward=(0.0, 1.0, 0.0))
TOP = Axes(side=(1.0, 0.0, 0.0), up=(0.0, 1.0, 0.0), inward=(0.0, 0.0, -1.0))


@dataclass(frozen=True, slots=True)
class Room:
    """In which the tip moves, round the object's centre.

    Args:
        axes: Axes of trigger and sticks.
        depth: Way of the tip over the whole way of the trigger [m].
        reach: How far the sticks move it, from the centre [m].
    """

    axes: Axes
    depth: float
    reach: float


@dataclass(frozen=True, slots=True)
class Cursor:
    """The tip in the axes of the pad.

    Args:
        side: To the right of the centre [m].
        up: Above it [m].
        base: Along `inward` from the centre, with the trigger released; negative in front [m].
        press: By the trigger, from there [m].
        blocked: Whether the right stick has to be let go before it moves the tip inward again.
        velocity: Velocity of side, up, and both others together [m/s].
    """

    side: float = 0.0
    up: float = 0.0
    base: float = 0.0
    press: float = 0.0
    blocked: bool = False
    velocity: Vec3 = ZERO


def moved(cursor: Cursor, held: Held, dt: float, room: Room, *, contact: bool) -> Cursor:
    """The cursor after `dt`.

    Args:
        cursor: Before.
        held: By the hands.
        dt: Time passed [s].
        room: In which it moves.
        contact: Whether the tip feels a force.
    """
    side, side_speed = _bounded(cursor.side, _rate(held.left[0]), dt, -room.reach, room.reach)
    up, up_speed = _bounded(cursor.up, _rate(held.left[1]), dt, -room.reach, room.reach)
    rate = _rate(held.right[1])
    # While it follows a trigger that was let go of quickly, the tip leaves the object by itself.
    released = held.pull <= RELEASED and cursor.press <= _AT_REST
    blocked = rate > 0.0 and (cursor.blocked or (contact and released))
    if released and contact:
        rate = -SPEED
    elif contact or blocked:
        rate = min(rate, 0.0)
    base, base_speed = _bounded(cursor.base, rate, dt, -room.reach, 0.0)
    goal = room.depth * max(0, held.pull - RELEASED) / (MOST - RELEASED)
    step = (goal - cursor.press) * -math.expm1(-dt / _SMOOTH)
    step = max(-FASTEST * dt, min(FASTEST * dt, step))
    press_speed = step / dt if dt > 0.0 else 0.0
    velocity = (side_speed, up_speed, base_speed + press_speed)
    return Cursor(side, up, base, cursor.press + step, blocked, velocity)


def position(cursor: Cursor, axes: Axes) -> Vec3:
    """The tip in the device's frame [m]."""
    return _along(axes, (cursor.side, cursor.up, cursor.base + cursor.press))


def velocity(cursor: Cursor, axes: Axes) -> Vec3:
    """Velocity of the tip, in the device's frame [m/s]."""
    return _along(axes, cursor.velocity)


def pull_of(cursor: Cursor, room: Room) -> int:
    """Pull at which the trigger would hold the tip where it is, 0 to 255."""
    return round(RELEASED + (MOST - RELEASED) * cursor.press / room.depth)


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
    """Place [m] and speed [m/s] after `dt`; a wall stops it."""
    after = place + rate * dt
    if after <= low:
        return low, max(0.0, rate)
    if after >= high:
        return high, min(0.0, rate)
    return after, rate
