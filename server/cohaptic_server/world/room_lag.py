"""The time of the room: its lag, from the contacts and loop delays of one tick (science 3.8)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

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
from cohaptic_server.world.state import UserState

# A lag rises at once, which holds forces where they are. It falls by this much per second, or by as
# much as itself, so that what was still to come does not come all at once.
FALL = 0.2


def find_lag(
    users: Sequence[UserState],
    compliance: Floats,
    where: Sequence[slice],
    near: Floats,
    before: RoomLag,
    dt: float,
) -> RoomLag:
    """The room's lag for the next tick.

    Args:
        users: With their contacts and measured delays.
        compliance: Between all their loads, floored, shape (loads, loads) [m/N].
        where: Which loads are whose.
        near: How much each counts as a neighbour, 0 to 1, shape (users,).
        before: Of the last tick.
        dt: Simulation period N T [s].
    """
    # Who has left, is silent, or too slow to take part closes no loop: its force only fades.
    longest, budget = dt, np.inf
    closes = [user.touch.fresh and not user.delay.too_long for user in users]
    near = near * np.array(closes, dtype=np.float64)
    for user, counts in zip(users, near.tolist(), strict=True):
        if counts > 0.0:
            # The client moves to a new patch over one period, which counts as one more.
            longest = max(longest, user.delay.counted + dt)
            budget = min(budget, user.touch.damping_budget)
    m = room_coupling(users, compliance, where, near)
    # The paper's laws have gains that bear any delay; they need no lag among themselves.
    ours = any(user.touch.law is Law.PREDICTIVE for user in users)
    wanted = choose_lag(m, longest, budget).lag if ours else 0.0
    lag = max(wanted, before.lag - max(FALL, before.lag) * dt)
    # What does not fit the wire is the most that does: no patch is lost for it, the margin tells.
    lag = min(MAX_LAG, lag)
    return RoomLag(lag, min(MAX_COUPLING, m), margin(m, longest, lag))


def room_coupling(
    users: Sequence[UserState], compliance: Floats, where: Sequence[slice], near: Floats
) -> float:
    """m, the spectral radius of S, with users who only approach counted by their nearness."""
    if len(users) < 2:
        return 0.0
    root = np.sqrt(np.repeat(near, [span.stop - span.start for span in where]))
    C = compliance * root[:, None] * root
    stiffness = [
        stiffness_of(user, compliance[span, span], others)
        for user, span, others in zip(users, where, _from_others(C, where), strict=True)
    ]
    S = coupling_matrix(C, stiffness)
    for user, span, K in zip(users, where, stiffness, strict=True):
        if user.touch.law is not Law.PREDICTIVE:
            # The paper's laws press on their own dent, too.
            S[span.start, span.start] += float(K[0, 0]) * C[span.start, span.start]
    return coupling_radius(S)


def _from_others(C: Floats, where: Sequence[slice]) -> list[float]:
    """Sum of |C| from all others to the normal of each user [m/N]."""
    rows = [np.abs(C[span.start]) for span in where]
    return [float(r.sum() - r[span].sum()) for r, span in zip(rows, where, strict=True)]


def stiffness_of(user: UserState, C: Floats, others: float = 0.0) -> Floats:
    """K of one hand, no softer than what it will be told, shape (1, 1) or (3, 3) [N/m].

    Args:
        user: Whose it is.
        C: Of its contact, shape (1, 1) or (3, 3) [m/N].
        others: Sum of |C| from the others, by which the paper's laws go [m/N].
    """
    own = float(C[0, 0])
    limit = user.touch.max_stiffness
    if user.touch.fixed_gains is not None:
        limit = min(limit, user.touch.fixed_gains.k_h)
        if user.touch.law is Law.PREDICTIVE:
            return np.asarray(limit * own * np.linalg.inv(C), dtype=np.float64)
    elif user.touch.law is not Law.PREDICTIVE:
        limit = min(limit, 1.0 / (own + others))
    return np.asarray(min(1.0, limit * own) * np.linalg.inv(C), dtype=np.float64)
