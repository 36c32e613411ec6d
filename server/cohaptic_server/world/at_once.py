"""Hands on a body without a network: the truth with which sessions are compared over time.

At every instant the body carries the forces that all hands have at that instant, and each contact
is located on the surface displaced by all forces but its own. There is no delay, no sampling, no
lag of the room and no limit of the rate of a force. `equilibrium` gives the state in which such
hands come to rest.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from cohaptic.vec import ZERO, Vec3
from cohaptic_server.bodies.body import Body, Response
from cohaptic_server.numeric import Floats, vec3
from cohaptic_server.world.contact import Contact, locate
from cohaptic_server.world.contact_tracking import RELAXATION
from cohaptic_server.world.displacement_field import CachedField, Field, FreeField, ZeroField
from cohaptic_server.world.equilibrium import complementarity, nonlinearity

PERIOD = 0.001  # s; a device holds its force for so long, in a session as well as here
# m beyond the contact's radius; edge of the window of displacements, farther than a contact moves
# between two instants. Reasoned, not measured.
_AROUND = 0.02

# Moves a hand up to a time [s] under the force [N] since the last call; returns its tip [m].
Mover = Callable[[float, Vec3], Vec3]


@dataclass(frozen=True, eq=False)
class _Located:
    """Contact of a hand, and the displacement field in which it was located."""

    contact: Contact
    surface: Field


class Felt(NamedTuple):
    """Forces of n hands at one instant.

    Args:
        force: Force on each hand along the normal of its surface, shape (n, 3) [N].
        from_others: Part of each normal force that the other hands cause, shape (n,) [N].
    """

    force: Floats
    from_others: Floats


class TouchAtOnce:
    """Forces of a body on the tips of several hands, instant after instant.

    Args:
        body: Touched body, at rest.
        hands: Number of hands, n.
        every: Number of instants for which a response of the body is used. Between two responses
            the body counts as linear about the last one, for bodies whose response takes long.
    """

    def __init__(self, body: Body, hands: int, every: int = 1) -> None:
        self._body, self._every, self._instants = body, every, 0
        self._carried = np.zeros(hands)  # forces that the last response carries [N]
        self._before: list[_Located | None] = [None] * hands
        self._force = np.zeros(hands)
        self._response: Response | None = None

    def felt(self, tips: Sequence[Vec3]) -> Felt:
        """Return the forces on hands whose tips are at `tips` [m]; contacts follow the tips."""
        located = [self._locate(tip, last) for tip, last in zip(tips, self._before, strict=True)]
        contacts = [hand.contact for hand in located]
        if self._instants % self._every == 0:
            self._carried = self._force
            loads = [c.load(f) for c, f in zip(contacts, self._force.tolist(), strict=True)]
            self._response = self._body.respond(loads, self._response)
        self._instants += 1
        response = self._response
        assert response is not None
        depth = np.array(
            [
                c.normal @ (c.point - np.array(tip)) - nonlinearity(c, response, i, self._carried)
                for i, (c, tip) in enumerate(zip(contacts, tips, strict=True))
            ]
        )
        self._before = [self._follow(hand, i) for i, hand in enumerate(located)]
        self._force = force = complementarity(response.compliance, depth)
        alone = np.maximum(0.0, depth) / response.compliance.diagonal()
        return Felt(force[:, None] * np.array([c.normal for c in contacts]), force - alone)

    @property
    def contacts(self) -> list[Contact]:
        """Contact of each hand at the last instant."""
        return [hand.contact for hand in self._before if hand is not None]

    @property
    def compliance(self) -> Floats:
        """Compliance C between these contacts, shape (n, n) [m/N]."""
        assert self._response is not None
        return self._response.compliance

    def _locate(self, tip: Vec3, last: _Located | None) -> _Located:
        surface, hint = (ZeroField(), None) if last is None else (last.surface, last.contact)
        body = self._body
        return _Located(
            locate(body.mesh, tip, surface, radius=body.contact_radius, hint=hint), surface
        )

    def _follow(self, hand: _Located, i: int) -> _Located:
        """Return a hand whose surface is moved by `RELAXATION` towards its free surface."""
        assert self._response is not None
        free = FreeField(self._response, self._carried[i : i + 1], slice(i, i + 1))
        near = self._body.mesh.near(hand.contact.foot, self._body.contact_radius + _AROUND)
        previous = hand.surface[near]
        moved = previous + RELAXATION * (free.on(near) - previous)
        return _Located(hand.contact, CachedField(near, moved, free))


@dataclass(frozen=True, eq=False)
class Motion:
    """Motion of n hands over t instants.

    Args:
        tips: Position of each tip, shape (n, 3, t) [m].
        force: Size of the force on each hand, shape (n, t) [N].
        from_others: Part of each force that the other hands cause, shape (n, t) [N].
    """

    tips: Floats
    force: Floats
    from_others: Floats


def play_at_once(
    body: Body,
    hands: Sequence[Mover],
    seconds: float,
    *,
    every: int = 1,
) -> Motion:
    """Let hands move on a body for some time, without a network.

    Args:
        body: Touched body, at rest.
        hands: Hands, which feel the force of the last instant until the next one.
        seconds: Duration [s]; the first instant is at `PERIOD`.
        every: Number of instants for which a response of the body is used.
    """
    n, steps = len(hands), round(seconds / PERIOD)
    touch, push = TouchAtOnce(body, n, every), [ZERO] * n
    motion = Motion(np.empty((n, 3, steps)), np.empty((n, steps)), np.empty((n, steps)))
    for k in range(steps):
        now = (k + 1) * PERIOD
        tips = [hand(now, force) for hand, force in zip(hands, push, strict=True)]
        felt = touch.felt(tips)
        push = [vec3(force) for force in felt.force]
        motion.tips[:, :, k] = tips
        motion.force[:, k] = np.linalg.norm(felt.force, axis=1)
        motion.from_others[:, k] = felt.from_others
    return motion
