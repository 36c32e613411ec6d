"""The patch of one user: where the free surface is, how stiff the body, which gains."""

from __future__ import annotations

import numpy as np

from cohaptic.control.friction import Compliance3
from cohaptic.control.gains import choose_gains, coupled_stiffness
from cohaptic.protocol.patch import Geometry, Patch
from cohaptic_server.bodies.body import Response
from cohaptic_server.bodies.mesh import Floats, vec3
from cohaptic_server.placing import REACH
from cohaptic_server.world_state import UserState

RIGID = 1e-6  # m/N; a contact on what is held has no compliance, and a stiffness has a limit
NEAR = 0.005  # m above the surface: from here on a probe counts fully as a neighbour


def nearness(user: UserState, point: Floats) -> float:
    """How much a user counts as a neighbour: 1 in contact or about to be, 0 out of reach."""
    height = float(user.contact.normal @ (np.array(user.touch.probe) - point))
    fade = (REACH - height) / (REACH - NEAR)
    return 1.0 if user.force > 0.0 else min(1.0, max(0.0, fade))


def row_of(C: Floats, response: Response, where: list[slice], i: int) -> list[float]:
    """Row i of C as the gains of user i see it: itself in full, the others by their nearness."""
    row: list[float] = C[i].tolist()
    row[i] = max(float(response.compliance[where[i].start, where[i].start]), RIGID)
    return row


def cut(
    user: UserState,
    x_free: Floats,
    row: list[float],
    i: int,
    compliance: Compliance3 | None,
    *,
    tick: int,
    now: float,
    dt: float,
) -> Patch:
    """The patch of one user."""
    touch, contact = user.touch, user.contact
    c_ii = row[i]
    gains = choose_gains(
        touch.law,
        row,
        i,
        max_stiffness=touch.max_stiffness,
        loop_delay=user.delay.value,
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
        k_o=1.0 / c_ii,
        k_o_coupled=coupled_stiffness(row),
        c_ii=c_ii,
        k_h=gains.k_h,
        integral_gain=gains.integral_gain,
        own_force=user.force,
        u_others=float(contact.normal @ (x_free - contact.point)),
        compliance=compliance,
    )
