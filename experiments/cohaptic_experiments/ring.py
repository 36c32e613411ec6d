"""Users in a ring round a body: their contacts, and a session that presses and holds."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from cohaptic.control.law import Law
from cohaptic.hands import HandScript
from cohaptic_experiments.measure import swing
from cohaptic_experiments.virtual_session import VirtualSession
from cohaptic_server.bodies.body import Body
from cohaptic_server.bodies.mesh import Floats
from cohaptic_server.contact import locate
from cohaptic_server.equilibrium import RestingHand, solve
from cohaptic_server.room import describe

DELAY, DEPTH = 0.08, 0.008
APPROACH = 1.3  # s


@dataclass(frozen=True, slots=True)
class Played:
    """What a session came to.

    Args:
        law: Of everybody.
        users: How many.
        error: Largest relative difference of a steady force from the truth.
        swing: Largest swing of a force in the last second over that force.
        seconds: How long it ran [s].
    """

    law: Law
    users: int
    error: float
    swing: float
    seconds: float


def ring(n: int) -> list[HandScript]:
    """Scripts of n hands evenly round the equator."""
    return [
        HandScript(math.pi + 2.0 * math.pi * i / n, depth=DEPTH, approach_at=APPROACH)
        for i in range(n)
    ]


def ring_compliance(body: Body, n: int) -> Floats:
    """C of n contacts evenly round the equator, shape (n, n) [m/N]."""
    info = describe(body)
    free = np.zeros_like(body.mesh.vertices)
    loads = [
        locate(
            body.mesh,
            np.array(script.intention(info.center, info.radius).surface),
            free,
            radius=body.contact_radius,
        ).load(0.0)
        for script in ring(n)
    ]
    return body.respond(loads).compliance


def play(body: Body, law: Law, n: int, seconds: float, seed: int) -> Played:
    """A session of n users who press and hold, against the truth."""
    info = describe(body)
    hands = [
        RestingHand(s.intention(info.center, info.radius).tip(1.0), s.hand.stiffness)
        for s in ring(n)
    ]
    truth = solve(body, hands).force
    session = VirtualSession(body)
    for i, script in enumerate(ring(n)):
        session.join(
            f"user{i}", script, law=law, delay=DELAY, jitter=0.1 * DELAY, seed=100 * seed + i
        )
    session.run(seconds)
    last = np.array([user.force[-1000:] for user in session.users.values()])
    steady = last[:, -200:].mean(axis=1)
    return Played(
        law,
        n,
        float(np.abs(steady / truth - 1.0).max()),
        max(swing(f - _line(f)) / f.mean() for f in last),
        seconds,
    )


def _line(f: Floats) -> Floats:
    """The slow way of a force that is still being restored, which is no oscillation, (n,) [N]."""
    t = np.arange(len(f))
    return np.asarray(np.polyval(np.polyfit(t, f, 2), t), dtype=np.float64)
