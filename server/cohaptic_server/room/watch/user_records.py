"""Records of users for a scene. The world is read here and nowhere else for display."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from cohaptic.protocol.patch import Patch
from cohaptic.protocol.scene import MAX_CURVATURE, MAX_LOOP_DELAY, MAX_USERS, UserRecord
from cohaptic_server.numeric import Floats, vec3
from cohaptic_server.world.state import UserState
from cohaptic_server.world.users import WorldState


def records(world: WorldState, patches: Mapping[int, Patch]) -> tuple[UserRecord, ...]:
    """One record for each user whose force the body carries, also while it fades after leaving.

    Args:
        world: After a tick.
        patches: Of the same tick, by user; users who have left have none.
    """
    users = list(world.users.values())[:MAX_USERS]
    return tuple(_record(user, patches.get(user.touch.user)) for user in users)


def displacement(world: WorldState, vertices: int) -> Floats:
    """Displacement of the surface after the last tick, shape (vertices, 3) [m]."""
    if world.response is None:
        return np.zeros((vertices, 3))
    return world.response.displacement


def _record(user: UserState, patch: Patch | None) -> UserRecord:
    touch, contact = user.touch, user.contact
    return UserRecord(
        user=touch.user,
        probe=touch.probe,
        foot=vec3(contact.foot),
        force=user.applied,
        c_ii=0.0 if patch is None else patch.c_ii,
        k_o_coupled=0.0 if patch is None else user.k_o_coupled,
        k_h=0.0 if patch is None else patch.k_h,
        integral_gain=0.0 if patch is None else patch.integral_gain,
        loop_delay=min(user.delay.value, MAX_LOOP_DELAY),
        normal=vec3(contact.normal),
        law=touch.law,
        geometry=touch.geometry,
        presence=user.presence,
        curvature=(
            0.0 if patch is None else min(MAX_CURVATURE, max(-MAX_CURVATURE, patch.curvature))
        ),
        fresh=touch.fresh,
        friction=touch.friction,
        x_free=vec3(contact.point) if patch is None else patch.x_free,
    )
