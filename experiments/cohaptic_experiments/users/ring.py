"""Users in a ring round a body: a session in which all press at once and hold."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from cohaptic.control.law import Law
from cohaptic.simulated.hand import HandScript
from cohaptic_experiments.paper.measure import swing
from cohaptic_experiments.virtual_session import PERIOD, VirtualSession
from cohaptic_server.bodies.body import Body
from cohaptic_server.numeric import Floats
from cohaptic_server.room.body_frames import describe
from cohaptic_server.world.equilibrium import RestingHand, solve

DELAY, DEPTH = 0.08, 0.008
APPROACH = 1.3  # s
REACHED = 0.01  # relative error within which a force counts as settled


@dataclass(frozen=True, eq=False)
class Played:
    """Result of a session.

    Args:
        law: Law of everybody.
        users: How many.
        seconds: How long it ran [s].
        error: Largest relative error of a steady force against the reference.
        swing: Largest swing of a force in the last second over that force.
        reached: Time from the begin of the press until every force stays within `REACHED` of the
            reference; infinite if some never does [s].
        step: Largest change of a force in a period that its hand's own motion does not explain [N].
        lag: Lag of the room, at the end [s].
        coupling: m of the room, at the end.
        furthest: Largest relative error of all hands, over time, shape (n,).
    """

    law: Law
    users: int
    seconds: float
    error: float
    swing: float
    reached: float
    step: float
    lag: float
    coupling: float
    furthest: Floats

    @property
    def t(self) -> Floats:
        """Time since the press began, of `furthest`, shape (n,) [s]."""
        t = PERIOD * np.arange(1, len(self.furthest) + 1) - APPROACH
        return np.asarray(t, dtype=np.float64)


def ring(n: int) -> list[HandScript]:
    """Scripts of n hands evenly round the equator."""
    return [
        HandScript(2.0 * math.pi * i / n - math.pi, depth=DEPTH, approach_at=APPROACH)
        for i in range(n)
    ]


def play(body: Body, law: Law, n: int, seconds: float, seed: int) -> Played:
    """A session of n users who press and hold, compared with the equilibrium."""
    info = describe(body)
    hands = [
        RestingHand(s.intention(info.center, info.radius).tip(1.0), s.hand.stiffness)
        for s in ring(n)
    ]
    reference = solve(body, hands).force
    session = VirtualSession(body)
    for i, script in enumerate(ring(n)):
        session.join(
            f"user{i}", script, law=law, delay=DELAY, jitter=0.1 * DELAY, seed=100 * seed + i
        )
    session.run(seconds)
    force = np.array([user.force for user in session.users.values()])
    furthest = np.abs(force / reference[:, None] - 1.0).max(axis=0)
    last = force[:, -1000:]
    room = session.room.world.room
    return Played(
        law,
        n,
        seconds,
        error=float(np.abs(last[:, -200:].mean(axis=1) / reference - 1.0).max()),
        swing=max(swing(f - _line(f)) / f.mean() for f in last),
        reached=reached(furthest),
        step=max(max(user.unexplained) for user in session.users.values()),
        lag=room.lag,
        coupling=room.coupling,
        furthest=furthest,
    )


def reached(furthest: Floats) -> float:
    """Time from the begin of the press until all forces stay within `REACHED` of the reference [s].

    Args:
        furthest: Largest relative error of a force, every `PERIOD`, shape (n,).
    """
    outside = np.flatnonzero(furthest > REACHED)
    if not outside.size:
        return 0.0
    after = int(outside[-1]) + 1
    return PERIOD * (after + 1) - APPROACH if after < len(furthest) else math.inf


def _line(f: Floats) -> Floats:
    """Quadratic trend of a force that still settles, which is no oscillation, shape (n,) [N]."""
    t = np.arange(len(f))
    return np.asarray(np.polyval(np.polyfit(t, f, 2), t), dtype=np.float64)
