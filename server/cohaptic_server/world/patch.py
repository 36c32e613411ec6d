"""The patch of one user: where the free surface is, how stiff the body, which gains."""

from __future__ import annotations

import numpy as np

from cohaptic.control.friction import Compliance3
from cohaptic.control.gains import choose_gains
from cohaptic.control.room_lag import RoomLag
from cohaptic.protocol.patch import Geometry, Patch
from cohaptic_server.numeric import Floats, vec3
from cohaptic_server.world.contact import REACH
from cohaptic_server.world.state import NEGLIGIBLE, UserState

NEAR = 0.005  # m above the surface: from here on a probe counts fully as a neighbour


def nearness(user: UserState, point: Floats) -> float:
    """How much a user counts as a neighbour: 1 in contact or about to be, 0 out of reach."""
    height = float(user.contact.normal @ (np.array(user.touch.probe) - point))
    fade = (REACH - height) / (REACH - NEAR)
    return 1.0 if user.force > NEGLIGIBLE else min(1.0, max(0.0, fade))


def cut(
    user: UserState,
    x_free: Floats,
    row: list[float],
    i: int,
    compliance: Compliance3 | None,
    room: RoomLag,
    *,
    tick: int,
    now: float,
    dt: float,
) -> Patch:
    """The patch of one user.

    Args:
        user: Whose it is.
        x_free: Its contact point on the surface free of its own force, shape (3,) [m].
        row: Of C between the users, as its gains see it [m/N].
        i: Its place in the row.
        compliance: Of its contact in all directions; None without friction.
        room: Lag of the room.
        tick: Number of this tick.
        now: Time of this tick on the server's clock [s].
        dt: Simulation period N T [s].
    """
    touch, contact = user.touch, user.contact
    c_ii = row[i]
    gains = choose_gains(
        touch.law,
        row,
        i,
        max_stiffness=touch.max_stiffness,
        loop_delay=user.delay.value + room.lag,  # the lag is in the loop of the paper's laws
        simulation_period=dt,
        fixed=touch.fixed_gains,
    )
    return Patch(
        tick=tick,
        seq=touch.seq,
        t_server=now,
        t_client=touch.t_client,
        sample_wait=max(0.0, now - touch.arrived),
        geometry=Geometry.PLANE,  # until `with_shape`
        law=touch.law,
        x_free=vec3(x_free),
        normal=vec3(contact.normal),
        curvature=0.0,
        c_ii=c_ii,
        k_h=gains.k_h,
        integral_gain=gains.integral_gain,
        own_force=vec3(user.carried),
        u_others=vec3(x_free - contact.point),
        room=room,
        compliance=compliance,
    )
