"""Which forces the body gets in a tick, from what the users want: an act of the world."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from cohaptic_server.bodies.body import Body
from cohaptic_server.numeric import Floats
from cohaptic_server.world.force_limits import EFFECT_RATE, behind, bounded, shares_of_change
from cohaptic_server.world.state import NEGLIGIBLE, Release, UserState, WorldState

# Radii of a sphere as large as the body, in which nobody presses deeper: through it and half again.
DEEPEST = 3.0
GO = 0.1  # s; lag at most of the force of one who has left


def release(
    state: WorldState, found: Sequence[UserState], step: float, *, jump: float
) -> tuple[Release, ...]:
    """What still fades where probes have left it, and what begins to, one for each user at most.

    Args:
        state: The world after the last tick.
        found: Everybody's contact in this tick.
        step: By which a share falls in a tick.
        jump: Way of a contact that no hand makes in a tick [m].
    """
    left = [
        replace(old, share=old.share - step) for old in state.releases if old.share - step > 0.0
    ]
    fading = {old.user for old in left}
    for user in found:
        before = state.users.get(user.touch.user)
        if before is None or before.force <= NEGLIGIBLE or user.touch.user in fading:
            continue
        if _is_elsewhere(state, user, jump):
            left.append(Release(user.touch.user, before.press, 1.0))
    return tuple(left)


def let_in(
    body: Body,
    state: WorldState,
    found: Sequence[UserState],
    elsewhere: Collection[int],
    dt: float,
    *,
    jump: float,
) -> list[UserState]:
    """The users with the forces that the body gets: bounded, behind the lag, not too fast.

    Args:
        body: That is touched.
        state: The world after the last tick.
        found: Everybody's contact and what it wants.
        elsewhere: Users whose force still fades where they were.
        dt: Simulation period N T [s].
        jump: Way of a contact that no hand makes in a tick [m].
    """
    if not found:
        return []
    C = _known(state, found, jump)
    own = np.diag(C)
    reach = DEEPEST * body.mesh.size
    deepest = np.where(np.isfinite(own), reach / np.maximum(own, 1e-12), np.inf)
    here = np.array([float(user.touch.user not in elsewhere) for user in found])
    was = here * np.array([_before(state, user) for user in found])
    wanted = here * np.array([user.wanted for user in found])
    # Who has left lets go in the usual time, however slow the room is.
    lag = np.array(
        [state.room.lag if user.touch.fresh else min(state.room.lag, GO) for user in found]
    )
    asked = bounded(wanted, deepest)
    normal = behind(was, asked, lag, dt)
    along, along_was = _along(state, found, here, asked / np.maximum(wanted, 1e-300))
    along = behind(along_was, along, lag[:, None], dt)
    change = np.abs(normal - was) + np.linalg.norm(along - along_was, axis=1)
    stiffness = np.array(
        [
            min(user.touch.max_stiffness, 1.0 / c if np.isfinite(c) else np.inf)
            for user, c in zip(found, own.tolist(), strict=True)
        ]
    )
    # Only a hand that feels something can be moved: who holds nothing asks nobody to wait.
    C[np.maximum(was, asked) <= NEGLIGIBLE] = 0.0
    share = shares_of_change(change, stiffness, C, EFFECT_RATE * dt)
    normal = was + share * (normal - was)
    along = along_was + share[:, None] * (along - along_was)
    return [
        replace(
            user,
            presence=user.presence * counts,
            force=force,
            along=None if user.wanted_along is None else tangent,
        )
        for user, counts, force, tangent in zip(
            found, here.tolist(), normal.tolist(), along, strict=True
        )
    ]


def _is_elsewhere(state: WorldState, user: UserState, jump: float) -> bool:
    """Whether a contact is new, or too far from where it was for a hand to have gone there."""
    before = state.users.get(user.touch.user)
    if before is None:
        return True
    way = user.contact.foot - before.contact.foot
    return float(way @ way) > jump * jump


def _before(state: WorldState, user: UserState) -> float:
    """Normal force of a user that the body carried in the last tick [N]."""
    before = state.users.get(user.touch.user)
    return 0.0 if before is None else before.force


def _along(
    state: WorldState, found: Sequence[UserState], here: Floats, whole: Floats
) -> tuple[Floats, Floats]:
    """Forces along the surface now and in the last tick, shape (n, 3) each [N].

    Args:
        state: The world after the last tick.
        found: Everybody's contact and what it wants.
        here: 1 for users whose force is where they are, 0 for the others.
        whole: Share of its normal force that the body is asked to carry.
    """
    now, was = np.zeros((len(found), 3)), np.zeros((len(found), 3))
    for i, user in enumerate(found):
        if user.wanted_along is None:
            continue
        now[i] = here[i] * whole[i] * user.wanted_along
        before = state.users.get(user.touch.user)
        if before is not None and before.along is not None:
            # The surface turns under a contact that slides; its force turns with it.
            n = user.contact.normal
            was[i] = here[i] * (before.along - (before.along @ n) * n)
    return now, was


def _known(state: WorldState, found: Sequence[UserState], jump: float) -> Floats:
    """C between users as the last tick found it, shape (n, n) [m/N].

    What a user does to others is infinite where it was not there yet, or somewhere else; what they
    do to it is none, for it holds nothing there yet.
    """
    row = {number: i for i, number in enumerate(state.users)}
    at = np.array(
        [-1 if _is_elsewhere(state, user, jump) else row[user.touch.user] for user in found]
    )
    C = np.full((len(found), len(found)), np.inf)
    C[at < 0] = 0.0
    np.fill_diagonal(C, np.inf)
    seen = np.flatnonzero(at >= 0)
    C[np.ix_(seen, seen)] = state.coupling[np.ix_(at[seen], at[seen])]
    return C
