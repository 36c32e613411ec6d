"""Who stands where round the body and does what, and what they would feel without a network."""

from __future__ import annotations

import math
from dataclasses import dataclass

from cohaptic.control.friction import MAX_FRICTION
from cohaptic.control.law import Law
from cohaptic.errors import SettingError
from cohaptic.simulated.hand import HandScript, Place, Rhythm
from cohaptic_server.bodies.body import Body
from cohaptic_server.room.body_frames import describe
from cohaptic_server.world.equilibrium import Equilibrium, RestingHand, solve

PRESS_DEPTH = 0.02  # m that the first user wants to press into the body; the others half of it
DRAG = 0.006  # m that a hand with friction drags: felt beside it, and no finger slips at mu = 0.6
BESIDE = math.radians(30.0)  # of the balloon, between two hands of which one drags
_SETTLE = 1.5  # s for a press, and for the hands to come to rest once nothing is late
_ROUND_TRIPS = 5.0  # that news needs to die out between two hands
MEASURE = 0.6  # s at the end of each press and release in which forces are compared
_JOIN = 3.0  # s for the hands to be engaged and at the body


@dataclass(frozen=True, slots=True)
class Scene:
    """A demonstration.

    Args:
        users: How many hands, evenly round the body; the first presses, the others rest.
        delay: Injected, one way, in both directions [s].
        jitter: Largest extra delay, one way [s].
        law: Local model of every client.
        simulation_hz: Ticks per second.
        seed: Of the jitter.
        duration: Of the demonstration [s]; None for no end.
        places: Of the hands on the surface; without any they stand evenly round the body.
        depth: That the first wants to press into the body, the others half of it [m].
        friction: mu of every finger. With it two hands stand side by side and press alike; the
            first drags along the surface, in its rhythm, and the second sticks to it. 0 for none.
    """

    users: int = 2
    delay: float = 0.08
    jitter: float = 0.0
    law: Law = Law.PREDICTIVE
    simulation_hz: float = 60.0
    seed: int = 0
    duration: float | None = None
    places: tuple[Place, ...] = ()
    depth: float = PRESS_DEPTH
    friction: float = 0.0

    def __post_init__(self) -> None:
        if not 2 <= self.users <= 16:
            raise SettingError("number of users", self.users, "from 2 to 16")
        if self.duration is not None and not 2.0 <= self.duration <= 86400.0:
            raise SettingError("duration", f"{self.duration:g} s", "from 2 s to a day")
        if not 0.0 <= self.friction <= MAX_FRICTION:
            raise SettingError("friction", self.friction, f"from 0 to {MAX_FRICTION:g}")
        if self.drags and self.users != 2:
            raise SettingError("number of users with friction", self.users, "2: one is dragged")

    @property
    def drags(self) -> bool:
        """Whether the first hand drags in its rhythm, and does not press."""
        return self.friction > 0.0

    @property
    def names(self) -> tuple[str, ...]:
        """Of the users: left, right, and numbers for the rest."""
        return ("left", "right", *(f"user{i}" for i in range(3, self.users + 1)))

    @property
    def angles(self) -> tuple[float, ...]:
        """Where each user stands [rad]; `right` is opposite `left`, the rest fill the circle.

        Where the one drags it has `right` beside it, on its own right.
        """
        if self.drags:
            return (math.pi, math.pi + BESIDE)
        opposite = self.users // 2
        order = [0, opposite, *(i for i in range(1, self.users) if i != opposite)]
        return tuple(math.pi + 2.0 * math.pi * i / self.users for i in order)

    @property
    def rhythm(self) -> Rhythm:
        """Of the pressing hand: long enough for forces to settle, short enough for the duration."""
        half = _SETTLE + 2.0 * _ROUND_TRIPS * (self.delay + self.jitter) + MEASURE
        if self.duration is not None:
            # Off and pressed; or off, pressed and dragged.
            parts = 3.0 if self.drags else 2.0
            half = min(half, max(1.0, self.duration - _JOIN) / parts)
        return Rhythm(2.0 * half)

    def script(self, user: int) -> HandScript:
        """What user number `user` (from 0) does."""
        first = user == 0
        return HandScript(
            angle=self.angles[user],
            depth=self.depth if first or self.drags else 0.5 * self.depth,
            rhythm=self.rhythm if first else None,
            place=self.places[user] if self.places else None,
            drag=DRAG if first and self.drags else 0.0,
        )


def truth(scene: Scene, body: Body, *, pressed: bool) -> Equilibrium:
    """Equilibrium of body and hands while the first hand presses, or while it is off."""
    info = describe(body)
    hands: list[RestingHand] = []
    for user in range(scene.users):
        script = scene.script(user)
        level = 1.0 if pressed or user > 0 else 0.0
        tip = script.intention(info.center, info.radius).tip(level)
        hands.append(RestingHand(tip, script.hand.stiffness))
    return solve(body, hands)
