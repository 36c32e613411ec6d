"""The forces that the body gets in a tick, from those that users request (science 3.8).

A requested force is limited, passes the room's lag, and is slowed down if it would move other hands
too fast. When a probe jumps, its force stays at the old contact and fades there.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from cohaptic_server.bodies.body import Body
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.world.force_limits import (
    EFFECT_RATE,
    allowed_shares,
    limit_forces,
    low_pass,
)
from cohaptic_server.world.lags.anticipation import anticipate
from cohaptic_server.world.loops.vectors import jumped, tangential_parts
from cohaptic_server.world.state import NEGLIGIBLE, Release
from cohaptic_server.world.users import Applied, Tracked, WorldState

# Largest indentation, in radii of a sphere with the body's area. A linear body has no limit of its
# own; three radii are one and a half diameters, deeper than any user presses on purpose.
MAX_INDENTATION = 3.0
MAX_RELEASE_LAG = 0.1  # s; bounds the lag for a user who has left, however slow the room is


def update_releases(
    state: WorldState, tracked: Tracked, fade: float, *, max_move: float
) -> tuple[Release, ...]:
    """Return the forces that fade where probes have left them: those still fading, and new ones.

    Args:
        state: The world after the last tick.
        tracked: Users with their contacts in this tick.
        fade: Decrease per tick of the share of each force that still acts.
        max_move: Distance that a hand can move a contact in one tick [m].

    Returns:
        At most one release for each user.
    """
    releases = [
        replace(release, share=release.share - fade)
        for release in state.releases
        if release.share - fade > 0.0
    ]
    fading = {release.user for release in releases}
    rows, anybody = _rows_before(state, tracked, max_move)
    if anybody:
        for i in np.flatnonzero((rows < 0) & (tracked.before >= 0)).tolist():
            user = tracked.touches[i].user
            if state.users[user].force > NEGLIGIBLE and user not in fading:
                releases.append(Release(user, state.users[user].press, 1.0))
    return tuple(releases)


# One step after another, each of which needs the arrays of those before it.
def apply_forces(
    body: Body,
    state: WorldState,
    tracked: Tracked,
    released: Collection[int],
    dt: float,
    *,
    max_move: float,
) -> Applied:
    """Decide the forces that the body gets, from those that users request.

    Args:
        body: The deformable object.
        state: The world after the last tick.
        tracked: Users with their contacts and requested forces.
        released: Users whose force still fades at a previous contact; they press nowhere else.
        dt: Simulation period N T [s].
        max_move: Distance that a hand can move a contact in one tick [m].
    """
    n, last = len(tracked.touches), state.users.applied
    if not n:
        return Applied(tracked.presence, tracked.requested, tracked.tangential)
    C = _previous_coupling(state, *_rows_before(state, tracked, max_move))
    # C_ii is infinite for a contact whose coupling is not known yet.
    c_ii = C.diagonal().copy()
    presence, requested, previous = tracked.presence, tracked.requested, np.zeros(n)
    here = tracked.before >= 0
    previous[here] = last.force[tracked.before[here]]
    present = np.ones(n)
    if released:
        present[[touch.user in released for touch in tracked.touches]] = 0.0
        presence, requested, previous = present * presence, present * requested, present * previous
    # A force is unbounded if its coupling is not known.
    max_force = MAX_INDENTATION * body.mesh.size / np.maximum(c_ii, 1e-12)
    max_force = np.where(c_ii < np.inf, max_force, np.inf)
    limited = limit_forces(requested, max_force)
    deep = limited < requested
    lag = _lags(state, tracked)
    along = was = tracked.tangential
    if tracked.rough:
        scale = present * (limited / np.maximum(requested, 1e-300))
        along = scale[:, None] * tracked.tangential
    if len(state.anticipation.users):
        limited, along = anticipate(state.anticipation, state.past, tracked, limited, along)
        limited = limit_forces(limited, max_force)
    normal = low_pass(previous, limited, lag, dt)
    change = np.abs(normal - previous)
    if tracked.rough:
        was = _previous_tangential(last, tracked, present)
        along = low_pass(was, along, lag[:, None], dt)
        aside = along - was
        change += np.sqrt(np.einsum("ij,ij->i", aside, aside))
    # Stiffness K of each hand, at most 1 / C_ii if C_ii is known.
    device = tracked.settings[1]
    stiffness = np.where(c_ii < np.inf, np.minimum(device, 1.0 / c_ii), device)
    # A hand that feels no force cannot be moved, so no user is slowed down for its sake.
    C[np.maximum(previous, limited) <= NEGLIGIBLE] = 0.0
    share = allowed_shares(change, stiffness, C, EFFECT_RATE * dt)
    tangential = was + share[:, None] * (along - was) if tracked.rough else along
    normal = previous + share * (normal - previous)
    return Applied(presence, normal, tangential, deep, share < 1.0)


def _rows_before(state: WorldState, tracked: Tracked, max_move: float) -> tuple[Ints, bool]:
    """Row of each user in the last tick, shape (n,), and whether any contact is new at its place.

    The row is -1 for a user who was not there, or whose contact moved further than a hand can.
    """
    rows = np.empty_like(tracked.before)
    old = state.users.tracked.contacts.frames
    return rows, jumped(tracked.contacts.frames, tracked.before, old, max_move, rows)


def _lags(state: WorldState, tracked: Tracked) -> Floats:
    """Lag of each force, shape (n,) [s]: the room's lag, cut short for a user who has left."""
    lag = state.room.lag
    return np.where(tracked.settings[3] > 0.0, lag, min(lag, MAX_RELEASE_LAG))


def _previous_tangential(last: Applied, tracked: Tracked, present: Floats) -> Floats:
    """Tangential forces of the last tick in the tangent planes of this one, shape (n, 3) [N].

    Under a sliding contact the tangent plane turns, and the force is projected onto it.

    Args:
        last: Forces of the last tick.
        tracked: Users with their contacts and requested forces.
        present: 1 for users who press at their contact, 0 for those whose force fades elsewhere.
    """
    was = np.zeros_like(tracked.tangential)
    for i in tracked.rough:
        if (row := tracked.before[i]) >= 0:
            was[i] = present[i] * last.tangential[row]
    projected = np.empty_like(was)
    tangential_parts(tracked.contacts.frames, was, projected)
    return projected


def _previous_coupling(state: WorldState, rows: Ints, anybody: bool) -> Floats:
    """Compliance C between users in the last tick, shape (n, n) [m/N].

    C is not known for a user who was not at the present contact then. The effect of such a user on
    others is set to infinity. The effect of others on that user is set to zero, since the user has
    no force at the contact yet.

    Args:
        state: The world after the last tick.
        rows: Row of each user in that tick; -1 if the user was not at the contact, shape (n,).
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
