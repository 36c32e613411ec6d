"""Defines the positions and actions of the hands, and their equilibrium without a network."""

from __future__ import annotations

import math
from dataclasses import dataclass

from cohaptic.control.friction import MAX_FRICTION
from cohaptic.control.law import DEFAULT_LAW, Law
from cohaptic.errors import SettingError
from cohaptic.simulated.delay_line import LinkSettings
from cohaptic.simulated.hand import HandScript, Place, Rhythm
from cohaptic.vec import ZERO, Vec3
from cohaptic_server.bodies.body import Body
from cohaptic_server.room.body_frames import describe
from cohaptic_server.world.equilibrium import MAX_ITERATIONS, Equilibrium, RestingHand, solve

MIN_USERS, MAX_USERS = 2, 16
PRESS_DEPTH = 0.02  # m; intended depth of the first hand's press; the others press half as deep
DRAG = 0.006  # m; length of a drag with friction: perceptible, and no finger slips at mu = 0.6
BESIDE = math.radians(30.0)  # angle around the balloon between two hands of which one drags
USUAL = LinkSettings(0.08)  # Europe to America
_SETTLE = 1.5  # s in which a hand presses and all hands come to rest, without any delay
_ROUND_TRIPS = 5.0  # round trips after which the mutual response of two hands has decayed
MEASURE = 0.6  # s at the end of each press and release over which forces are averaged
_JOIN = 3.0  # s within which the hands are engaged and at the body


@dataclass(frozen=True, slots=True)
class Scene:
    """Settings of a demonstration: the actions of the hands, and the injected delay.

    Args:
        users: Number of hands; the first hand presses, the others rest.
        link: Injected network, one way, the same in both directions.
        law: Control law of every client.
        simulation_hz: Ticks per second.
        seed: Seed of the link's draws.
        duration: Duration of the demonstration [s]; None without an end.
        places: Places of the hands on the surface; if empty, the hands stand evenly around the
            body.
        origin: Origin of the frame of `places`, as a point of the frame of the object's file [m].
        depth: Intended depth of the first hand; the others press half as deep [m].
        friction: Coefficient of friction of every finger; 0 without friction. With friction two
            hands stand side by side and press equally deep; the first drags along the surface, and
            the second sticks to the surface.
    """

    users: int = 2
    link: LinkSettings = USUAL
    law: Law = DEFAULT_LAW
    simulation_hz: float = 60.0
    seed: int = 0
    duration: float | None = None
    places: tuple[Place, ...] = ()
    origin: Vec3 = ZERO
    depth: float = PRESS_DEPTH
    friction: float = 0.0

    def __post_init__(self) -> None:
        if not MIN_USERS <= self.users <= MAX_USERS:
            raise SettingError("number of users", self.users, f"from {MIN_USERS} to {MAX_USERS}")
        if self.duration is not None and not 2.0 <= self.duration <= 86400.0:
            raise SettingError("duration", f"{self.duration:g} s", "from 2 s to a day")
        if not 0.0 <= self.friction <= MAX_FRICTION:
            raise SettingError("friction", self.friction, f"from 0 to {MAX_FRICTION:g}")
        if self.drags and self.users != 2:
            raise SettingError("number of users with friction", self.users, "2: one is dragged")

    @property
    def drags(self) -> bool:
        """Whether the first hand drags rather than presses in its rhythm."""
        return self.friction > 0.0

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the users: left, right, user3, user4 and so on."""
        return ("left", "right", *(f"user{i}" for i in range(3, self.users + 1)))

    @property
    def angles(self) -> tuple[float, ...]:
        """Angle of each user around the body [rad]; `right` is opposite `left`, the others between.

        In a scene with friction `right` stands beside `left`, to its right.
        """
        if self.drags:
            return (math.pi, math.pi + BESIDE)
        opposite = self.users // 2
        order = [0, opposite, *(i for i in range(1, self.users) if i != opposite)]
        return tuple(2.0 * math.pi * i / self.users - math.pi for i in order)

    @property
    def rhythm(self) -> Rhythm:
        """Rhythm of the first hand; its period is long enough for forces to settle.

        In a short demonstration the period is shorter, so that it contains a whole period, and
        forces may not settle.
        """
        half = self._half
        if self.duration is not None:
            half = min(half, max(1.0, self.duration - _JOIN) / self._parts)
        return Rhythm(2.0 * half)

    @property
    def enough(self) -> float:
        """Least duration of a demonstration in which a press and a release come to rest [s]."""
        return _JOIN + self._parts * self._half

    @property
    def _half(self) -> float:
        """Duration of one part of a period in which forces can settle [s]."""
        return _SETTLE + 2.0 * _ROUND_TRIPS * self.link.longest + MEASURE

    @property
    def _parts(self) -> float:
        """Number of parts of a period: 2 (off, pressed), or 3 (off, pressed, dragged)."""
        return 3.0 if self.drags else 2.0

    def script(self, user: int) -> HandScript:
        """Return the script of user number `user` (from 0): place, depth and rhythm of its hand."""
        first = user == 0
        return HandScript(
            angle=self.angles[user],
            depth=self.depth if first or self.drags else 0.5 * self.depth,
            rhythm=self.rhythm if first else None,
            place=self.places[user] if self.places else None,
            drag=DRAG if first and self.drags else 0.0,
        )


def reference(
    scene: Scene, body: Body, *, pressed: bool, iterations: int = MAX_ITERATIONS
) -> Equilibrium:
    """Return the equilibrium of body and hands without a network.

    Args:
        scene: Scene with the places and depths of the hands.
        body: Body at rest.
        pressed: True for the equilibrium with the first hand pressed, False with it off the body.
        iterations: Largest number of iterations for the contacts to come to rest.

    Raises:
        BodyError: The contacts still slide after these iterations.
    """
    info = describe(body)
    hands: list[RestingHand] = []
    for user in range(scene.users):
        script = scene.script(user)
        level = 1.0 if pressed or user > 0 else 0.0
        intention = script.intention(info.center, info.radius)
        hands.append(RestingHand(intention.tip(level), script.hand.stiffness, intention.tip(0.0)))
    return solve(body, hands, iterations)
