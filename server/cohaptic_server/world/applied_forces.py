"""From the forces that users request to those that the body gets in a tick (science 3.8).

A request is limited, passes the room's lag, and is slowed down where it would move other hands too
fast. A probe that jumps leaves its force behind, to fade where it was.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from cohaptic.vec import norm, sub
from cohaptic_server.bodies.body import Body
from cohaptic_server.numeric import Floats
from cohaptic_server.world.force_limits import (
    EFFECT_RATE,
    allowed_shares,
    limit_forces,
    low_pass,
)
from cohaptic_server.world.state import NEGLIGIBLE, Release, UserState, WorldState

# Largest indentation, in radii of a sphere with the body's area. A linear body has no limit of its
# own; three radii are one and a half diameters, deeper than anybody presses on purpose.
MAX_INDENTATION = 3.0
MAX_RELEASE_LAG = 0.1  # s; bounds the lag for a user who has left, however slow the room is


def update_releases(
    state: WorldState, tracked: Sequence[UserState], fade: float, *, max_move: float
) -> tuple[Release, ...]:
    """Forces that fade where probes have left them: those still fading, and new ones.

    Args:
        state: The world after the last tick.
        tracked: Users with their contacts in this tick.
        fade: Decrease of a share in one tick.
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
    for user in tracked:
        previous = state.users.get(user.touch.user)
        if previous is None or previous.force <= NEGLIGIBLE or user.touch.user in fading:
            continue
        if _has_jumped(state, user, max_move):
            releases.append(Release(user.touch.user, previous.press, 1.0))
    return tuple(releases)


def apply_forces(
    body: Body,
    state: WorldState,
    tracked: Sequence[UserState],
    released: Collection[int],
    dt: float,
    *,
    max_move: float,
) -> list[UserState]:
    """Decide the forces that the body gets, from those that users request.

    Args:
        body: The deformable object.
        state: The world after the last tick.
        tracked: Users with their contacts and requested forces.
        released: Users whose force still fades at a previous contact; they press nowhere else.
        dt: Simulation period N T [s].
        max_move: Distance that a hand can move a contact in one tick [m].

    Returns:
        The users with their applied forces, in the same order.
    """
    if not tracked:
        return []
    C = _previous_coupling(state, tracked, max_move)
    # Of a contact whose coupling is not known yet it is infinite.
    c_ii = C.diagonal().copy()
    present = np.array([float(user.touch.user not in released) for user in tracked])
    previous = present * np.array([_previous_force(state, user) for user in tracked])
    requested = present * np.array([user.requested for user in tracked])
    indentation = MAX_INDENTATION * body.mesh.size
    max_force = np.where(np.isfinite(c_ii), indentation / np.maximum(c_ii, 1e-12), np.inf)
    limited = limit_forces(requested, max_force)
    scale = present * (limited / np.maximum(requested, 1e-300))
    tangential, previous_tangential = _tangential_forces(state, tracked, present, scale)
    lag = np.array([_lag_of(state, user) for user in tracked])
    normal = low_pass(previous, limited, lag, dt)
    tangential = low_pass(previous_tangential, tangential, lag[:, None], dt)

    aside = tangential - previous_tangential
    change = np.abs(normal - previous) + np.sqrt(np.einsum("ij,ij->i", aside, aside))
    stiffness = _hand_stiffness(tracked, c_ii)
    # A hand that feels no force cannot be moved, so nobody is slowed down for its sake.
    C[np.maximum(previous, limited) <= NEGLIGIBLE] = 0.0
    share = allowed_shares(change, stiffness, C, EFFECT_RATE * dt)
    normal = previous + share * (normal - previous)
    tangential = previous_tangential + share[:, None] * (tangential - previous_tangential)
    return [
        user.carrying(
            force, None if user.requested_tangential is None else along, user.presence * counts
        )
        for user, counts, force, along in zip(
            tracked, present.tolist(), normal.tolist(), tangential, strict=True
        )
    ]


def _has_jumped(state: WorldState, user: UserState, max_move: float) -> bool:
    """Whether a contact is new, or further from its previous one than a hand can move it."""
    previous = state.users.get(user.touch.user)
    if previous is None:
        return True
    return norm(sub(user.contact.places[0], previous.contact.places[0])) > max_move


def _lag_of(state: WorldState, user: UserState) -> float:
    """Lag of a user's force [s]: the room's, and a short one for a user who has left."""
    return state.room.lag if user.touch.fresh else min(state.room.lag, MAX_RELEASE_LAG)


def _hand_stiffness(tracked: Sequence[UserState], c_ii: Floats) -> Floats:
    """K of each hand, at most 1 / C_ii where that is known, shape (n,) [N/m]."""
    device = np.array([user.touch.max_stiffness for user in tracked])
    return np.where(np.isfinite(c_ii), np.minimum(device, 1.0 / c_ii), device)


def _previous_force(state: WorldState, user: UserState) -> float:
    """Normal force of a user that the body carried in the last tick [N]."""
    previous = state.users.get(user.touch.user)
    return 0.0 if previous is None else previous.force


def _tangential_forces(
    state: WorldState, tracked: Sequence[UserState], present: Floats, scale: Floats
) -> tuple[Floats, Floats]:
    """Tangential forces requested now, and those of the last tick, shape (n, 3) each [N].

    Args:
        state: The world after the last tick.
        tracked: Users with their contacts and requested forces.
        present: 1 for users who press at their contact, 0 for those whose force fades elsewhere.
        scale: Factor of the requested tangential force, that of the limited normal force.
    """
    requested, previous = np.zeros((len(tracked), 3)), np.zeros((len(tracked), 3))
    for i, user in enumerate(tracked):
        if user.requested_tangential is None:
            continue  # no friction
        requested[i] = scale[i] * user.requested_tangential
        before = state.users.get(user.touch.user)
        if before is not None and before.tangential is not None:
            # Under a sliding contact the tangent plane turns, and the force is projected onto it.
            n = user.contact.normal
            previous[i] = present[i] * (before.tangential - (before.tangential @ n) * n)
    return requested, previous


def _previous_coupling(state: WorldState, tracked: Sequence[UserState], max_move: float) -> Floats:
    """C between users in the last tick, shape (n, n) [m/N].

    For a user who was not at its contact then, it is not known. The effect of such a user on others
    is set to infinity; the effect of others on it to zero, since it holds no force there yet.
    """
    row = {number: i for i, number in enumerate(state.users)}
    index = [-1 if _has_jumped(state, user, max_move) else row[user.touch.user] for user in tracked]
    if index == list(range(len(state.coupling))):
        return state.coupling.copy()  # nobody came, left or jumped
    C = np.full((len(tracked), len(tracked)), np.inf)
    C[np.array(index) < 0] = 0.0
    np.fill_diagonal(C, np.inf)
    known = [i for i, before in enumerate(index) if before >= 0]
    before = [index[i] for i in known]
    C[np.ix_(known, known)] = state.coupling[np.ix_(before, before)]
    return C
