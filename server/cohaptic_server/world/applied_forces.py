"""Decide the forces that the body gets in a tick, from those that users request (science 3.8).

A requested force is cut to the limits of its contact and of the body, passes the room's lag, and
changes more slowly if it would change the force on another hand too fast. When a probe jumps to
another contact, its force stays at the old contact and fades there.

Samples are old when they arrive, so the forces that hands are about to have are predicted from the
samples (science 3.13). At its end, each tick chooses the part of the coupling to be anticipated
(`planning.py`). The next tick multiplies this part with the change of the forces, which is the
difference between two forces: the force in a sample, and the force that the body carried in the
tick whose patch that sample answers.

The sum and the rate of change of the forces are limited. A force that grows to 6 N within 0.1 s
changes the force on a neighbour that shares all of the hand's compliance by 60 N/s, and is not
limited. If several users together would change the force on another user faster, the largest
changes are cut to a common cap and smaller changes stay as they are, so that only the user who
shakes the body is slowed down. A contact that slides over the body also changes the forces on
others, without a change of its own force. The server leaves this to the clients, whose own limit is
stricter (`cohaptic_client.loop.slew`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cohaptic.control.stability.lag_choice import kept
from cohaptic.vec import norm
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.world.loops.vectors import jumped, tangential_parts
from cohaptic_server.world.state import NEGLIGIBLE, Anticipation, Carried, Release, TickTime, Touch
from cohaptic_server.world.users import Applied, Tracked, WorldState


def remember(
    past: tuple[Carried, ...], time: TickTime, tracked: Tracked, applied: Applied, ticks: int
) -> tuple[Carried, ...]:
    """Append the forces that the body carries in this tick to those of the last ticks.

    Args:
        past: Forces that the body carried in earlier ticks, oldest first.
        time: Number and time of this tick.
        ticks: Number of ticks to keep: all those whose patches samples may still answer.

    Returns:
        Forces of the last `ticks` ticks, this tick included, oldest first.
    """
    forces = tracked.contacts.normals * applied.force[:, None] + applied.tangential
    at = round(1e9 * time.elapsed) + (past[-1].at if past else 0)
    return (*past[1 - ticks :], Carried(time.number, at, _numbers(tracked), forces))


def anticipate(
    plan: Anticipation,
    past: Sequence[Carried],
    tracked: Tracked,
    normal: Floats,
    tangential: Floats,
) -> tuple[Floats, Floats]:
    """Predict the forces that hands will have when each has felt the newest forces of the others.

    Args:
        plan: Part of the coupling to anticipate, chosen at the end of the last tick.
        past: Forces that the body carried in earlier ticks, oldest first.
        normal: Normal force of each user, cut to the limits of its contact, shape (n,) [N].
        tangential: Tangential force of each user, shape (n, 3) [N].

    Returns:
        Predicted normal forces, shape (n,), and tangential forces, shape (n, 3) [N]. The forces of
        users who are not in the plan, or who do not press, stay as they are.
    """
    numbers = _numbers(tracked)
    rows = np.flatnonzero((numbers[:, None] == plan.users).any(axis=1))  # few: `isin` takes longer
    if not past or not len(rows) or not np.array_equal(numbers[rows], plan.users):
        return normal, tangential  # a user of the plan has left: this tick ends with a new plan
    frames = tracked.contacts.frames[rows]
    answers = frames[:, 2] * normal[rows, None] + tangential[rows]
    f = np.einsum("li,li->l", answers[plan.owner], plan.axes)
    carried = _carried(plan, past, [tracked.touches[i].tick for i in rows.tolist()])
    # (3.13) u* = (1 + X)^-1 (phi + [sum_j X_ij u_j(t_i)]_i), with phi = f and u(t_i) = carried
    # (3.13) u* = phi - (1 + X)^-1 [sum_j X_ij (phi_j - u_j(t_i))]_i, the same
    difference = np.einsum("lk,lk->l", plan.part, f - carried[plan.owner])
    change = (plan.solve @ -difference)[:, None] * plan.axes
    moved = np.add.reduceat(change, np.searchsorted(plan.owner, np.arange(len(rows))), axis=0)
    # A user without force is about to touch or has let go: anticipation must not make it press.
    moved *= (normal[rows] > 0.0)[:, None]
    push = np.einsum("ij,ij->i", moved, frames[:, 2])
    ahead, along = normal.copy(), tangential
    ahead[rows] = np.minimum(tracked.settings[0, rows], np.maximum(0.0, ahead[rows] + push))
    if tracked.frictional:
        along = tangential.copy()
        frictional = np.isin(rows, tracked.frictional)
        aside = moved - push[:, None] * frames[:, 2]
        along[rows[frictional]] += aside[frictional]
    return ahead, along


def _carried(plan: Anticipation, past: Sequence[Carried], ticks: Sequence[int]) -> Floats:
    """Return the forces of the l loads in the tick that each user's sample answers, (k, l) [N]."""
    forces = np.empty((len(ticks), len(plan.owner)))
    newest, oldest = past[-1].tick, past[0].tick
    answered = np.array(ticks)
    for tick in set(ticks):
        then = past[min(max(tick, oldest), newest) - oldest]
        along = np.einsum("li,li->l", then.of(plan.users)[plan.owner], plan.axes)
        forces[answered == tick] = along
    return forces


def _numbers(tracked: Tracked) -> Ints:
    return np.array([touch.user for touch in tracked.touches], dtype=np.int64)


# N/s by which all others together may change the force on one hand. Fingers that tap reach about
# 100 N/s on their own force, and a neighbour feels the share that it has of their compliance. A
# press of 6 N within 0.1 s passes, and a blow does not (test_force_limits.py).
EFFECT_RATE = 60.0
MAX_SUM = 160.0  # N, of all forces on a body: sixteen hands at the 10 N of a usual device
# Largest change of the force on one hand per change of another's force. A hand at a stiff place
# beside a soft one can be moved by several times the other's force; ten bounds that ratio where
# the coupling is not known yet. Reasoned, not measured.
MAX_COUPLING_RATIO = 10.0


def fair_cap(demands: Floats, total: float) -> float:
    """Find the cap to which demands are cut so that their sum becomes `total` (max-min fairness).

    Args:
        demands: Demands of the users, none negative, shape (n,).
        total: Amount available to all users together, in the unit of the demands.

    Returns:
        Largest demand that any user is granted; infinite if the demands need no cut.
    """
    if demands.sum() <= total:
        return np.inf
    available, users = total, len(demands)
    for demand in np.sort(demands):
        # Smaller demands are met in full; the larger ones share the rest evenly.
        if available <= demand * users:
            break
        available -= demand
        users -= 1
    return available / max(1, users)


def limit_forces(requested: Floats, max_force: Floats) -> Floats:
    """Return the requested normal forces, cut to the limits of contacts and body, shape (n,) [N].

    Args:
        requested: Force requested by each user, shape (n,) [N].
        max_force: Largest force of each contact, shape (n,) [N].
    """
    forces = np.minimum(requested, max_force)
    return np.minimum(forces, fair_cap(forces, MAX_SUM))


def allowed_fractions(change: Floats, stiffness: Floats, C: Floats, max_effect: float) -> Floats:
    """Return the share of each user's change of force that this tick allows, 0 to 1, shape (n,).

    Args:
        change: Magnitude of each user's change of force, shape (n,) [N].
        stiffness: Stiffness K of each hand, shape (n,) [N/m].
        C: Compliance between contacts, infinite where it is not known yet, shape (n, n) [m/N].
        max_effect: Largest change of the force on one hand by all other users together [N].
    """
    # The campaign compiles this function with numba, which supports only a part of numpy.
    fractions = np.ones_like(change)
    # Change of the force on each hand (row) by each user (column); an unknown compliance is
    # replaced by the worst case.
    effect = np.minimum(stiffness.reshape(-1, 1) * np.abs(C), MAX_COUPLING_RATIO) * change
    effect.reshape(-1)[:: len(change) + 1] = 0.0  # its diagonal
    moved = effect.sum(axis=1)
    if not (moved > max_effect).any():
        return fractions
    for i in np.flatnonzero(moved > max_effect):
        row = effect[i]
        fractions = np.minimum(fractions, fair_cap(row, max_effect) / np.maximum(row, 1e-300))
    return fractions


def low_pass(previous: Floats, requested: Floats, lag: Floats, dt: float) -> Floats:
    """Return the forces after one tick of a first-order lag, any shape [N].

    Args:
        previous: Forces applied in the last tick [N].
        requested: Forces that the lagged forces approach, of the same shape [N].
        lag: Time constant of each force, of a shape that broadcasts [s].
        dt: Time since the last tick [s].
    """
    return np.asarray(requested + kept(lag, dt) * (previous - requested))


def within_budget(touches: Sequence[Touch], budget: float) -> list[Touch]:
    """Return samples whose `max_force` is cut fairly, so that all forces sum to at most `budget`.

    Args:
        touches: Newest samples of all users.
        budget: Largest sum of the forces of all users [N].
    """
    demands = np.array([min(t.who.max_force, norm(t.force)) if t.fresh else 0.0 for t in touches])
    cap = fair_cap(demands, budget)
    return [
        t if t.who.max_force <= cap else replace(t, who=replace(t.who, max_force=cap))
        for t in touches
    ]


# Largest indentation, in radii of a sphere with the body's area. A linear body has no limit of its
# own; three radii are one and a half diameters, deeper than any user presses on purpose, and than
# the presses of the paper's figures. Reasoned, not measured.
MAX_INDENTATION = 3.0
# s; least lag of a hand whose force the body does not carry yet. The room's lag counts that hand
# only from the next tick on. The value is the lag of two hands on opposite sides of the balloon, on
# devices that damp fully. With 0.25 s two hands on a lobe of rubber kept swinging behind 250 ms
# (tests/system/test_rubber_lobe.py).
FIRST_LAG = 0.03
# s; a hand that lets go on purpose takes about as long. Reasoned, not measured.
RELEASE_TIME = 0.3
# s; bounds the lag for a user who has left, however slow the room is: a third of `RELEASE_TIME`, so
# that the fade sets the pace (test_applied_forces.py). Reasoned, not measured.
MAX_RELEASE_LAG = 0.1


def update_releases(
    state: WorldState, tracked: Tracked, rows: Ints, fade: float
) -> tuple[Release, ...]:
    """Update the forces that fade at contacts from which probes have jumped away.

    Args:
        state: The world after the last tick.
        tracked: Users with their contacts in this tick.
        rows: Row of each in the last tick; -1 for one whose contact jumped, too, shape (n,).
        fade: Decrease per tick of the share of each force that still acts.

    Returns:
        Forces that still fade, and those of probes that jumped in this tick; at most one per user.
    """
    releases = [
        replace(release, fraction=release.fraction - fade)
        for release in state.releases
        if release.fraction - fade > 0.0
    ]
    fading = {release.user for release in releases}
    for i in np.flatnonzero((rows < 0) & (tracked.before >= 0)).tolist():
        user = tracked.touches[i].user
        if state.users[user].force > NEGLIGIBLE and user not in fading:
            releases.append(Release(user, state.users[user].press, 1.0))
    return tuple(releases)


def rows_before(state: WorldState, tracked: Tracked, max_move: float) -> tuple[Ints, bool]:
    """Return each user's row in the last tick, shape (n,), and whether any row is -1.

    The row is -1 for a user who was not in the last tick, or whose contact moved further than a
    hand can move it.
    """
    rows = np.empty_like(tracked.before)
    old = state.users.tracked.contacts.frames
    return rows, jumped(tracked.contacts.frames, tracked.before, old, max_move, rows)


def lags_of(state: WorldState, tracked: Tracked, previous: Floats, requested: Floats) -> Floats:
    """Return the lag of each force [s], shape (n,).

    It is the room's lag, shorter where a user's samples have stopped, and longer for the first
    force of a hand among others.

    Args:
        state: The world after the last tick.
        tracked: Users with their contacts and requested forces.
        previous: Normal force of each user in the last tick, shape (n,) [N].
        requested: Normal force of each user that the lagged force approaches, shape (n,) [N].
    """
    lag = state.room.lag
    lags = np.where(tracked.settings[3] > 0.0, lag, min(lag, MAX_RELEASE_LAG))
    if len(previous) > 1:
        first = (previous <= NEGLIGIBLE) & (requested > previous)
        lags = np.where(first, np.maximum(lags, FIRST_LAG), lags)
    return lags


def previous_tangential(last: Applied, tracked: Tracked, present: Floats) -> Floats:
    """Project the tangential forces of the last tick onto the present tangent planes, (n, 3) [N].

    Args:
        last: Forces of the last tick.
        tracked: Users with their contacts and requested forces.
        present: 1 for users who press at their contact, 0 for those whose force fades elsewhere.
    """
    was = np.zeros_like(tracked.tangential)
    for i in tracked.frictional:
        if (row := tracked.before[i]) >= 0:
            was[i] = present[i] * last.tangential[row]
    projected = np.empty_like(was)
    tangential_parts(tracked.contacts.frames, was, projected)
    return projected


def previous_coupling(state: WorldState, rows: Ints, anybody: bool) -> Floats:
    """Return the compliance C between the users' contacts in the last tick, shape (n, n) [m/N].

    C is not known for a user whose contact is new. The column of such a user, its effect on others,
    is set to infinity. Its row, the effect of others on it, is set to zero, since the user has no
    force at the contact yet.

    Args:
        state: The world after the last tick.
        rows: Row of each user in that tick; -1 if the user's contact is new, shape (n,).
        anybody: Whether any row is -1.
    """
    n = len(rows)
    if not anybody and n == len(state.coupling) and (rows[1:] > rows[:-1]).all():
        return state.coupling.copy()  # no user came, left or jumped
    C = np.full((n, n), np.inf)
    C[rows < 0] = 0.0
    np.fill_diagonal(C, np.inf)
    known = np.flatnonzero(rows >= 0)
    C[np.ix_(known, known)] = state.coupling[np.ix_(rows[known], rows[known])]
    return C
