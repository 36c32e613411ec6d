"""A simulated hand: its mechanics (mass, damper, spring) and its intention, a path of its tip.

The client integrates the hand's motion at the rate of its device; the server's reference solution
only needs the hand's stiffness and intention. Both import the classes from this module.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Final

from cohaptic.errors import SettingError
from cohaptic.vec import ZERO, Vec3, add, cross, norm, scale, unit

# Largest stiffness over mass [1/s^2]: a quarter of the stability limit of `move`, which is
# 4 / dt^2 = 4e6 for semi-implicit Euler without damping in steps of 1 ms.
MAX_PER_MASS = 1e6


@dataclass(frozen=True, slots=True)
class Hand:
    """Mass, damper and spring of a hand that follows an intention.

    Science 3.4 has the ranges of real hands.

    Args:
        mass: Mass of hand and device together [kg].
        damping: Damping of the tip's absolute velocity [N s/m].
        stiffness: Stiffness of the spring between the intended position and the tip [N/m].
    """

    mass: float = 0.15
    damping: float = 8.0
    stiffness: float = 400.0

    def __post_init__(self) -> None:
        for name, value, low, high in (
            ("hand mass", self.mass, 0.01, 5.0),
            ("hand damping", self.damping, 0.0, 1000.0),
            # The stiffest values model a clamp, a rig that holds a device at a depth.
            ("hand stiffness", self.stiffness, 1.0, min(1e5, MAX_PER_MASS * self.mass)),
        ):
            if not low <= value <= high:
                raise SettingError(name, value, f"from {low} to {high}")


@dataclass(frozen=True, slots=True)
class Rhythm:
    """Rhythm of a hand that releases and presses, each for half of the period.

    Args:
        period: Period of one release and press [s].
    """

    period: float

    def __post_init__(self) -> None:
        if not 0.1 <= self.period <= 3600.0:
            raise SettingError("rhythm", f"{self.period:g} s", "from 0.1 to 3600 s")

    @property
    def ramp(self) -> float:
        """Time that one press or one release takes [s]."""
        return min(0.3, 0.2 * self.period)

    def level(self, t: float) -> float:
        """Return the level at `t` [s]: 0 if released (first half), 1 if pressed (second half)."""
        t = t % self.period
        half = 0.5 * self.period
        if t < half:
            return 1.0 - ease(t / self.ramp) if t < self.ramp else 0.0
        return ease((t - half) / self.ramp)


@dataclass(frozen=True, slots=True)
class Intention:
    """Intended position of a hand's tip over time.

    The tip waits in front of `surface` and approaches it along `direction` to `depth` beyond it.
    Without a rhythm it stays there. With a rhythm it presses and lets go; a hand that drags instead
    presses once, after half a period, and then moves by `drag` along the surface and back.

    Args:
        surface: Point of the resting surface in front of the hand [m].
        direction: Unit vector into the body.
        depth: Distance of the pressed tip beyond `surface` [m].
        clearance: Distance of the released tip in front of `surface` [m].
        approach_at: Time at which the approach begins [s].
        approach_time: Duration of the approach [s].
        rhythm: Rhythm of pressing or dragging; None to stay at `depth`.
        drag: Displacement along the surface of a hand that drags; 0 for other hands [m].
    """

    surface: Vec3
    direction: Vec3
    depth: float
    clearance: float = 0.01
    approach_at: float = 0.0
    approach_time: float = 0.5
    rhythm: Rhythm | None = None
    drag: Vec3 = ZERO

    @property
    def drags(self) -> bool:
        """Whether the hand drags out and back in its rhythm, instead of pressing and letting go."""
        return self.drag != ZERO

    @property
    def _presses_at(self) -> float:
        """Time at which a hand that drags begins to press [s]; other hands touch by then."""
        return self.approach_at + (0.5 * self.rhythm.period if self.rhythm else 0.0)

    def level(self, t: float) -> float:
        """Return the level at `t` [s]: 0 if released or not dragged, 1 at `depth` or `drag`."""
        since = t - (self._presses_at if self.drags else self.approach_at)
        if since <= 0.0:
            return 0.0
        if self.rhythm is None:
            return ease(since / self.approach_time)
        # A rhythm begins with a release; at the start the hand is released already.
        return self.rhythm.level(since) if since > self.rhythm.ramp else 0.0

    def tip(self, level: float) -> Vec3:
        """Return the intended position of the tip at a level [m].

        A hand that drags is at `depth` at every level, as after it has pressed.
        """
        if self.drags:
            pressed = add(self.surface, scale(self.direction, self.depth))
            return add(pressed, scale(self.drag, level))
        travel = -self.clearance + (self.clearance + self.depth) * level
        return add(self.surface, scale(self.direction, travel))

    def position(self, t: float) -> Vec3:
        """Return the intended position [m] of the tip at the time `t` [s]."""
        tip = self.tip(self.level(t))
        if not self.drags:
            return tip
        to_come = 1.0 - ease((t - self._presses_at) / self.approach_time)
        return add(tip, scale(self.direction, -(self.clearance + self.depth) * to_come))


@dataclass(frozen=True, slots=True)
class Place:
    """A point of a body's resting surface, with the direction into the body.

    Args:
        point: Point of the surface [m]; in the settings of a client in the frame of the object's
            file, in a session of the experiments in that of the world.
        inward: Unit vector into the body at that point.
    """

    point: Vec3
    inward: Vec3

    def __post_init__(self) -> None:
        if not all(map(math.isfinite, (*self.point, *self.inward))):
            raise SettingError("place of a hand", (*self.point, *self.inward), "finite numbers")
        if not 0.999 <= norm(self.inward) <= 1.001:
            raise SettingError("length of the way in", f"{norm(self.inward):g}", "1")


@dataclass(frozen=True, slots=True)
class HandScript:
    """The user's description of a simulated hand: where it presses a body, how deep and when.

    Args:
        angle: Direction of the hand seen from above, 0 to the right of the body, counter-clockwise
            [rad].
        depth: Intended depth below the resting surface [m].
        rhythm: Rhythm of pressing and releasing; None to press all the time.
        approach_at: Time at which the first approach begins [s].
        hand: Mechanics of the hand.
        place: Place on the surface; None for the point at `angle` on the sphere round the body.
        drag: Horizontal displacement of a hand that drags along the surface in its rhythm, instead
            of letting go; positive to the hand's own right, which is counter-clockwise seen from
            above; 0 for other hands [m].
    """

    angle: float = math.pi
    depth: float = 0.015
    rhythm: Rhythm | None = None
    approach_at: float = 1.0
    hand: Hand = field(default_factory=Hand)
    place: Place | None = None
    drag: float = 0.0

    def __post_init__(self) -> None:
        if not abs(self.drag) <= 0.2:
            limit = "from -200 to 200 mm"
            raise SettingError("drag of a hand", f"{1e3 * self.drag:g} mm", limit)
        if self.drag and self.rhythm is None:
            raise SettingError("drag of a hand", f"{1e3 * self.drag:g} mm", "given with a rhythm")
        if not 0.0 <= self.depth <= 0.2:
            raise SettingError("depth of a hand", f"{1e3 * self.depth:g} mm", "from 0 to 200 mm")
        if not abs(self.angle) <= 2.0 * math.pi:  # also catches most angles meant in degrees
            raise SettingError("angle of a hand", f"{self.angle:g} rad", "from -2 pi to 2 pi rad")

    def intention(self, center: Vec3, radius: float) -> Intention:
        """Return the hand's intention at a body in the sphere of `radius` round `center` [m]."""
        out: Vec3 = (math.cos(self.angle), math.sin(self.angle), 0.0)
        place = self.place or Place(add(center, scale(out, radius)), scale(out, -1.0))
        return Intention(
            surface=place.point,
            direction=place.inward,
            depth=self.depth,
            approach_at=self.approach_at,
            rhythm=self.rhythm,
            drag=scale(sideways(place.inward), self.drag),
        )


def sideways(inward: Vec3) -> Vec3:
    """Return the horizontal unit vector that points to the right for a view along `inward`."""
    return unit(cross(inward, (0.0, 0.0, 1.0)), (1.0, 0.0, 0.0))


@dataclass(init=False)
class HandState:
    """Position [m] and velocity [m/s] of a simulated hand's tip."""

    position: Final[Vec3]
    velocity: Final[Vec3]

    def __init__(self, position: Vec3, velocity: Vec3) -> None:
        self.position = position
        self.velocity = velocity


def move(state: HandState, hand: Hand, target: Vec3, force: Vec3, dt: float) -> HandState:
    """Return the state of a hand one time step later (semi-implicit Euler, stable for dt <= 1 ms).

    Args:
        state: Position [m] and velocity [m/s] of the tip.
        hand: Mechanics of the hand.
        target: Intended position of the tip [m].
        force: Force of the device on the hand [N].
        dt: Time step [s].
    """
    x, v = state.position, state.velocity
    k, b, m = hand.stiffness, hand.damping, hand.mass
    # The damping is implicit, so that no step is too long for it.
    shrink = 1.0 / (1.0 + b * dt / m)
    vx = (v[0] + dt * (k * (target[0] - x[0]) + force[0]) / m) * shrink
    vy = (v[1] + dt * (k * (target[1] - x[1]) + force[1]) / m) * shrink
    vz = (v[2] + dt * (k * (target[2] - x[2]) + force[2]) / m) * shrink
    return HandState((x[0] + dt * vx, x[1] + dt * vy, x[2] + dt * vz), (vx, vy, vz))


def ease(s: float) -> float:
    """Return the smooth step from 0 (s = 0) to 1 (s = 1), with zero slope at both ends."""
    s = min(1.0, max(0.0, s))
    return s * s * (3.0 - 2.0 * s)
