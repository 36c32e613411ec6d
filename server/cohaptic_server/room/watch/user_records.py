"""From the world to what a scene says of it. Whatever of the world is shown is read here."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from cohaptic.protocol.patch import Patch
from cohaptic.protocol.scene import MAX_CURVATURE, MAX_LOOP_DELAY, MAX_USERS, UserRecord
from cohaptic.vec import Vec3
from cohaptic_server.numeric import Floats
from cohaptic_server.world.state import UserState, WorldState


def records(world: WorldState, patches: Mapping[int, Patch]) -> tuple[UserRecord, ...]:
    """Everybody whose force the body carries, those too who have left and fade.

    Args:
        world: After a tick.
        patches: Of the same tick, by user; who has left has none.
    """
    users = list(world.users.values())[:MAX_USERS]
    return tuple(_record(user, patches.get(user.touch.user)) for user in users)


def displacement(world: WorldState, vertices: int) -> Floats:
    """Of the surface after the last tick, shape (vertices, 3) [m]."""
    if world.response is None:
        return np.zeros((vertices, 3))
    return world.response.displacement


def _record(user: UserState, patch: Patch | None) -> UserRecord:
    touch, contact = user.touch, user.contact
    force = user.applied
    limit = MAX_CURVATURE
    return UserRecord(
        user=touch.user,
        probe=touch.probe,
        foot=_vec(contact.foot),
        force=_vec(force),
        c_ii=0.0 if patch is None else patch.c_ii,
        k_o_coupled=0.0 if patch is None else user.k_o_coupled,
        k_h=0.0 if patch is None else patch.k_h,
        integral_gain=0.0 if patch is None else patch.integral_gain,
        loop_delay=min(user.delay.value, MAX_LOOP_DELAY),
        normal=_vec(contact.normal),
        law=touch.law,
        geometry=touch.geometry,
        presence=user.presence,
        curvature=0.0 if patch is None else min(limit, max(-limit, patch.curvature)),
        fresh=touch.fresh,
        friction=touch.friction,
        x_free=_vec(contact.point) if patch is None else patch.x_free,
    )


def _vec(a: Floats) -> Vec3:
    return (float(a[0]), float(a[1]), float(a[2]))
