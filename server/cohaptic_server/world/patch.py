"""The patch of one user: the free surface at its contact, the body's stiffness there, the gains."""

from __future__ import annotations

from collections.abc import Sequence

from cohaptic.control.friction import Compliance3
from cohaptic.control.gains import choose_gains
from cohaptic.control.room_lag import RoomLag
from cohaptic.protocol.patch import Patch
from cohaptic.vec import Vec3, dot, sub
from cohaptic_server.bodies.touched_body import TouchedBody
from cohaptic_server.world.contact import MAX_CONTACT_HEIGHT
from cohaptic_server.world.patch_geometry import free_shape
from cohaptic_server.world.state import NEGLIGIBLE, TickTime, UserState, UserTick

NEAR_HEIGHT = 0.005  # m above the surface; a probe below it counts fully as a neighbour


def nearness(user: UserState, x_free: Vec3) -> float:
    """Weight of a user as a neighbour: 1 in contact or about to be, 0 out of reach.

    Args:
        user: With the force of this tick.
        x_free: Its contact point on the surface free of its own force [m].
    """
    height = dot(user.contact.places[2], sub(user.touch.probe, x_free))
    fade = (MAX_CONTACT_HEIGHT - height) / (MAX_CONTACT_HEIGHT - NEAR_HEIGHT)
    return 1.0 if user.force > NEGLIGIBLE else min(1.0, max(0.0, fade))


def build_patch(
    touched_body: TouchedBody,
    user: UserTick,
    row: Sequence[float],
    compliance: Compliance3 | None,
    room: RoomLag,
    time: TickTime,
) -> Patch:
    """Build the patch of one user, with the geometry that it asked for.

    Args:
        touched_body: The deformable object and its touch mesh.
        user: Whose patch it is.
        row: Its row of C between users, each other user weighted by nearness, of length n [m/N].
        compliance: 3x3 compliance of its contact; None without friction.
        room: Lag of the room.
        time: Of this tick.
    """
    state = user.state
    touch, contact = state.touch, state.contact
    gains = choose_gains(
        touch.law,
        row,
        user.index,
        max_stiffness=touch.max_stiffness,
        loop_delay=state.delay.value + room.lag,  # the lag is in the loop of the paper's laws
        simulation_period=time.period,
        fixed=touch.fixed_gains,
    )
    _, point, normal = contact.places
    curvature, neighbourhood = free_shape(
        touched_body, user.window, user.free.values, user.x_free, normal
    )
    return Patch(
        tick=time.number,
        seq=touch.seq,
        t_server=time.now,
        t_client=touch.t_client,
        sample_wait=max(0.0, time.now - touch.arrived),
        geometry=user.window.geometry,
        law=touch.law,
        x_free=user.x_free,
        normal=normal,
        curvature=curvature,
        c_ii=row[user.index],
        k_h=gains.k_h,
        integral_gain=gains.integral_gain,
        own_force=state.applied,
        u_others=sub(user.x_free, point),
        room=room,
        neighbourhood=neighbourhood,
        compliance=compliance,
    )
