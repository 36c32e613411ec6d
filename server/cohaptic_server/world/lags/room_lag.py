"""The room's lag, from the contacts and loop delays of one tick (science 3.8)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from cohaptic.control.delay import LoopDelay
from cohaptic.control.law import Law
from cohaptic.control.room_lag import RoomLag
from cohaptic.control.stability.lag_choice import (
    choose_lag,
    coupling_matrix,
    coupling_radius,
    margin,
)
from cohaptic.protocol.patch import MAX_COUPLING, MAX_LAG
from cohaptic_server.numeric import Floats
from cohaptic_server.world.state import Touch

# Seconds that the lag falls per second while it is below this value; above it, it falls by its own
# size per second. It may rise at once: the room needs the longer lag now, and a longer lag only
# slows the forces on their way. If it fell at once, forces that it still holds back would reach the
# body within one tick, as a jump.
FALL_RATE = 0.2


class Hand(Protocol):
    """What a lag depends on of a user."""

    @property
    def touch(self) -> Touch:
        """Its newest sample, with the settings that it joined with."""
        ...

    @property
    def delay(self) -> LoopDelay:
        """Measured delay of its loop."""
        ...


def find_lag(
    users: Sequence[Hand],
    compliance: Floats,
    spans: Sequence[slice],
    nearness: Floats,
    previous: RoomLag,
    dt: float,
) -> RoomLag:
    """The room's lag for the next tick.

    Args:
        users: With their contacts and measured delays.
        compliance: Between all their loads, bounded, shape (loads, loads) [m/N].
        spans: Loads of each user.
        nearness: Weight of each user as a neighbour, 0 to 1, shape (users,).
        previous: Lag of the last tick.
        dt: Simulation period N T [s].
    """
    # A user who has left, is silent, or is too slow to take part closes no loop: its force fades.
    closes_loop = [user.touch.fresh and not user.delay.too_long for user in users]
    nearness = nearness * np.array(closes_loop, dtype=np.float64)
    longest_delay, damping_budget = dt, np.inf
    for user, weight in zip(users, nearness.tolist(), strict=True):
        if weight > 0.0:
            # The client blends into a new patch over one period, which adds to the delay.
            longest_delay = max(longest_delay, user.delay.counted + dt)
            damping_budget = min(damping_budget, user.touch.damping_budget)
    m = room_coupling(users, compliance, spans, nearness)
    # The gains of the paper's laws are chosen for any delay; such users need no lag.
    predictive = any(user.touch.law is Law.PREDICTIVE for user in users)
    needed = choose_lag(m, longest_delay, damping_budget).lag if predictive else 0.0
    lag = max(needed, previous.lag - max(FALL_RATE, previous.lag) * dt)
    # A lag beyond the range of the wire is cut to it, so that patches still go out; the margin
    # then shows that it is too short.
    lag = min(MAX_LAG, lag)
    return RoomLag(lag, min(MAX_COUPLING, m), margin(m, longest_delay, lag))


def room_coupling(
    users: Sequence[Hand], compliance: Floats, spans: Sequence[slice], nearness: Floats
) -> float:
    """m, the spectral radius of S, each user weighted by its nearness."""
    if len(users) < 2:
        return 0.0
    if len(compliance) == len(users):  # nobody has friction: one direction each
        root = np.sqrt(nearness)
        C = compliance * root[:, None] * root
        own = compliance.diagonal().tolist()
        others = (np.abs(C).sum(axis=1) - np.abs(C.diagonal())).tolist()
        shares = map(_share, users, own, others)
        K = [share / c for share, c in zip(shares, own, strict=True)]
        stiffness: Sequence[Floats] | Floats = np.array(K).reshape(-1, 1, 1)
    else:
        root = np.sqrt(np.repeat(nearness, [span.stop - span.start for span in spans]))
        C = compliance * root[:, None] * root
        stiffness = [
            hand_stiffness(user, compliance[span, span], others)
            for user, span, others in zip(users, spans, _sums_of_others(C, spans), strict=True)
        ]
    S = coupling_matrix(C, stiffness)
    for user, span, K in zip(users, spans, stiffness, strict=True):
        if user.touch.law is not Law.PREDICTIVE:
            # The paper's laws also respond to the dent of their own force.
            S[span.start, span.start] += float(K[0, 0]) * C[span.start, span.start]
    return coupling_radius(S)


def _sums_of_others(C: Floats, spans: Sequence[slice]) -> list[float]:
    """Sum of |C| from all others to the normal of each user [m/N]."""
    first = [span.start for span in spans]
    sums = np.add.reduceat(np.abs(C[first]), first, axis=1)
    others: list[float] = (sums.sum(axis=1) - sums.diagonal()).tolist()
    return others


def hand_stiffness(user: Hand, C: Floats, others: float = 0.0) -> Floats:
    """K of one hand, no softer than the gain that it is sent, shape (1, 1) or (3, 3) [N/m].

    Args:
        user: Whose hand it is.
        C: Compliance of its contact, shape (1, 1) or (3, 3) [m/N].
        others: Sum of |C| from the others, which limits the gains of the paper's laws [m/N].
    """
    c_ii = float(C[0, 0])
    inverse = np.linalg.inv(C) if len(C) > 1 else np.array([[1.0 / c_ii]])
    return np.asarray(_share(user, c_ii, others) * inverse, dtype=np.float64)


def _share(user: Hand, c_ii: float, others: float) -> float:
    """K of one hand along the normal, as a share of the body's stiffness there.

    Args:
        user: Whose hand it is.
        c_ii: Compliance of its contact along the normal [m/N].
        others: Sum of |C| from the others [m/N].
    """
    touch, limit = user.touch, user.touch.max_stiffness
    if touch.fixed_gains is not None:
        limit = min(limit, touch.fixed_gains.k_h)
        share = limit * c_ii
        return share if touch.law is Law.PREDICTIVE else min(1.0, share)
    if touch.law is not Law.PREDICTIVE:
        limit = min(limit, 1.0 / (c_ii + others))
    return min(1.0, limit * c_ii)
