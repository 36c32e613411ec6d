"""The feedback loop in which the hands of a room move each other (science 3.2, 3.8).

The loop consists of the hands that press. A hand in the air answers nothing, however near the
surface it is, so it does not change what the others get. A hand that touches is in the loop from
the tick in which the body first carries its force; the lag rises at the end of that tick, and until
then the force passes a lag of its own (`applied_forces.FIRST_LAG`). A hand that has let go stays
in the loop until the body no longer carries its force, behind a lag tau for 7 to 10 tau.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from cohaptic.control.delay import LoopDelay
from cohaptic.control.stability.lag_choice import coupling_matrix
from cohaptic_server.numeric import Floats, Mask
from cohaptic_server.world.state import Touch


class Hand(Protocol):
    """Properties of a user on which the room's lag depends."""

    @property
    def touch(self) -> Touch:
        """Newest sample of the user, with the settings that it joined with."""
        ...

    @property
    def delay(self) -> LoopDelay:
        """Measured delay of the user's loop."""
        ...


@dataclass(frozen=True, eq=False, slots=True)
class RoomLoop:
    """The loop in which each hand answers the displacement of its contact by the others' forces.

    Args:
        users: All n users of the room.
        spans: Span of each user's loads in the rows of `S`.
        inside: Whether each user is in the loop, shape (n,).
        stiffness: Stiffness K of each hand, also of those outside, (1, 1) or (3, 3) [N/m].
        stiffest: Largest K of a hand in the loop, in any direction [N/m].
        S: Coupling matrix of science 3.8, zero for users outside, shape (loads, loads).
        longest_delay: T_max, the longest loop delay plus the period in which a client blends into a
            new patch [s].
        damping_budget: Smallest damping budget of a device in the loop, infinite if the loop has
            none [N s/m].
        slowest: Numbers of the users with the longest loop delay.
        weakest: Numbers of the users with the smallest damping budget.
        predictive: Whether any user in the loop has the predictive control law.
        paper_laws: Whether any user in the loop has one of the paper's control laws.
    """

    users: Sequence[Hand]
    spans: Sequence[slice]
    inside: Mask
    stiffness: Sequence[Floats] | Floats
    stiffest: float
    S: Floats
    longest_delay: float
    damping_budget: float
    slowest: tuple[int, ...]
    weakest: tuple[int, ...]
    predictive: bool
    paper_laws: bool


def takes_part(user: Hand) -> bool:
    """Return whether a user is in a loop while it presses.

    A user who has left, is silent, or is too slow to take part is not: its force fades.
    """
    return user.touch.fresh and not user.delay.too_long


def room_loop(
    users: Sequence[Hand], compliance: Floats, spans: Sequence[slice], pressing: Mask, dt: float
) -> RoomLoop:
    """Return the loop of a room in one tick.

    Args:
        users: Users with their newest samples and measured delays.
        compliance: Compliance between all loads, bounded, shape (loads, loads) [m/N].
        spans: Span of each user's loads in `compliance`.
        pressing: Whether the body carries a force of each user, shape (users,).
        dt: Simulation period N T [s].
    """
    within: list[bool] = pressing.tolist()
    longest_delay, damping_budget, predictive, paper_laws = dt, np.inf, False, False
    slowest: list[int] = []
    weakest: list[int] = []
    for i, (user, presses) in enumerate(zip(users, within, strict=True)):
        if not presses or not takes_part(user):
            within[i] = False
            continue
        touch = user.touch
        predictive = predictive or not touch.who.law.answers_own_dent
        paper_laws = paper_laws or touch.who.law.answers_own_dent
        # The client blends into a new patch over one period, which adds to the delay.
        delay = user.delay.counted + dt
        if delay > longest_delay:
            longest_delay, slowest = delay, []
        if delay == longest_delay:
            slowest.append(touch.user)
        if touch.who.damping_budget < damping_budget:
            damping_budget, weakest = touch.who.damping_budget, []
        if touch.who.damping_budget == damping_budget:
            weakest.append(touch.user)
    inside = np.array(within, dtype=np.bool_)
    stiffness, S = _coupling(users, compliance, spans, inside)
    return RoomLoop(
        users=users,
        spans=spans,
        inside=inside,
        stiffness=stiffness,
        stiffest=_stiffest(inside, stiffness),
        S=S,
        longest_delay=longest_delay,
        damping_budget=damping_budget,
        slowest=tuple(slowest),
        weakest=tuple(weakest),
        predictive=predictive,
        paper_laws=paper_laws,
    )


def _coupling(
    users: Sequence[Hand], compliance: Floats, spans: Sequence[slice], inside: Mask
) -> tuple[Sequence[Floats] | Floats, Floats]:
    """Return the stiffness K of each hand, and the coupling matrix S of those inside the loop."""
    if len(users) < 2:
        return np.zeros((0, 1, 1)), np.zeros((0, 0))
    if len(compliance) == len(users):  # no user has friction: one direction each
        C = compliance * inside[:, None] * inside
        own = compliance.diagonal().tolist()
        others = (np.abs(C).sum(axis=1) - np.abs(C.diagonal())).tolist()
        fractions = map(_fraction, users, own, others)
        K = [fraction / c for fraction, c in zip(fractions, own, strict=True)]
        stiffness: Sequence[Floats] | Floats = np.array(K).reshape(-1, 1, 1)
    else:
        rows = np.repeat(inside, [span.stop - span.start for span in spans])
        C = compliance * rows[:, None] * rows
        stiffness = [
            hand_stiffness(user, compliance[span, span], others)
            for user, span, others in zip(users, spans, _sums_of_others(C, spans), strict=True)
        ]
    S = coupling_matrix(C, stiffness)
    for user, span, K in zip(users, spans, stiffness, strict=True):
        if user.touch.who.law.answers_own_dent:
            # The paper's laws also respond to the dent of their own force.
            S[span.start, span.start] += float(K[0, 0]) * C[span.start, span.start]
    return stiffness, S


def _stiffest(inside: Mask, K: Sequence[Floats] | Floats) -> float:
    """Return the largest stiffness K of a hand in the loop, in any direction [N/m].

    A hand whose gains its user has chosen may be stiffer than the body. With friction, the largest
    row sum of |K| bounds the eigenvalues of K and nearly equals the largest one.
    """
    if not len(K) or not inside.any():  # one hand alone, or none
        return 0.0
    if isinstance(K, np.ndarray):
        return float(K[inside, 0, 0].max())
    return max(float(np.abs(K[i]).sum(axis=1).max()) for i in np.flatnonzero(inside).tolist())


def _sums_of_others(C: Floats, spans: Sequence[slice]) -> list[float]:
    """Return the sum of |C| from each user's normal to the loads of all others [m/N]."""
    first = [span.start for span in spans]
    sums = np.add.reduceat(np.abs(C[first]), first, axis=1)
    others: list[float] = (sums.sum(axis=1) - sums.diagonal()).tolist()
    return others


def hand_stiffness(user: Hand, C: Floats, others: float = 0.0) -> Floats:
    """Return the stiffness K with which one hand counts in the loop, (1, 1) or (3, 3) [N/m].

    K is at least the gain that the server sends to the hand's client.

    Args:
        user: User of the hand.
        C: Compliance of the hand's contact, shape (1, 1) or (3, 3) [m/N].
        others: Sum of |C_ij| over the loads j of all other users, which limits the gains of the
            paper's laws [m/N].
    """
    c_ii = float(C[0, 0])
    inverse = np.linalg.inv(C) if len(C) > 1 else np.array([[1.0 / c_ii]])
    return np.asarray(_fraction(user, c_ii, others) * inverse, dtype=np.float64)


def _fraction(user: Hand, c_ii: float, others: float) -> float:
    """Return the stiffness K of a hand along the normal over the body's stiffness, 1 / `c_ii`.

    Args:
        user: User of the hand.
        c_ii: Compliance of the hand's contact along the normal [m/N].
        others: As for `hand_stiffness` [m/N].
    """
    touch, limit = user.touch, user.touch.who.max_stiffness
    if touch.who.fixed_gains is not None:
        limit = min(limit, touch.who.fixed_gains.k_h)
        fraction = limit * c_ii
        return min(1.0, fraction) if touch.who.law.answers_own_dent else fraction
    if touch.who.law.answers_own_dent:
        limit = min(limit, 1.0 / (c_ii + others))
    return min(1.0, limit * c_ii)
