"""Builds patches: the free surface and the body's stiffness at each user's contact, and gains."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from cohaptic.control.friction import Compliance3
from cohaptic.control.gains import choose_gains
from cohaptic.control.room_lag import RoomLag
from cohaptic.protocol.patch import Patch
from cohaptic.vec import Vec3
from cohaptic_server.bodies.touched_body import TouchedBody
from cohaptic_server.numeric import Floats
from cohaptic_server.world.contact import MAX_CONTACT_HEIGHT
from cohaptic_server.world.patch_geometry import free_shapes
from cohaptic_server.world.state import NEGLIGIBLE, TickTime
from cohaptic_server.world.users import Applied, Observed, Tracked

NEAR_HEIGHT = 0.005  # m above the surface; a probe below it counts fully as a neighbour


def nearness(height: Floats, force: Floats) -> Floats:
    """Weight of each user as a neighbour, shape (n,): 1 in contact or about to be, 0 out of reach.

    Args:
        height: Height of each probe over the surface free of its own force, shape (n,) [m].
        force: Normal force of each user that the body carries, shape (n,) [N].
    """
    fade = (MAX_CONTACT_HEIGHT - height) / (MAX_CONTACT_HEIGHT - NEAR_HEIGHT)
    return np.where(force > NEGLIGIBLE, 1.0, np.fmin(1.0, np.fmax(0.0, fade)))


def build_patches(
    touched_body: TouchedBody,
    users: Tracked,
    applied: Applied,
    observed: Observed,
    connected: Collection[int],
    rows: Sequence[Sequence[float]],
    delays: Sequence[float],
    compliance: Sequence[Compliance3 | None],
    room: RoomLag,
    time: TickTime,
) -> dict[int, Patch]:
    """Build the patch of each connected user, with the geometry that the user asked for.

    Args:
        touched_body: The deformable object and its touch mesh.
        connected: Numbers of the users who get a patch.
        rows: Rows of C between users, the other users weighted by nearness, shape (n, n) [m/N].
        delays: Loop delays for which gains are chosen [s].
        compliance: 3x3 compliance of each contact; None without friction.
    """
    frames, x_free = users.contacts.frames, observed.x_free
    normals = np.ascontiguousarray(frames[:, 2])
    curvatures, neighbourhoods = free_shapes(
        touched_body, observed.windows, observed.free, x_free, normals
    )
    own = applied.force[:, None] * normals
    if users.rough:
        own += applied.tangential
    places, normal, force = _tuples(x_free), _tuples(normals), _tuples(own)
    by_others, curved = _tuples(x_free - frames[:, 1]), curvatures.tolist()
    patches: dict[int, Patch] = {}
    for i, (touch, delay) in enumerate(zip(users.touches, delays, strict=True)):
        if touch.user not in connected:
            continue
        gains = choose_gains(
            touch.law,
            rows[i],
            i,
            max_stiffness=touch.max_stiffness,
            # The room's lag is part of the loop of the paper's laws.
            loop_delay=delay + room.lag,
            simulation_period=time.period,
            fixed=touch.fixed_gains,
        )
        # Arguments by position: keywords would take twice as long.
        patches[touch.user] = Patch(
            time.number, touch.seq, time.now, touch.t_client, max(0.0, time.now - touch.arrived),
            touch.geometry, touch.law, places[i], normal[i], curved[i], rows[i][i], gains.k_h,
            gains.integral_gain, force[i], by_others[i], room, neighbourhoods[i], compliance[i],
        )  # fmt: skip
    return patches


def _tuples(vectors: Floats) -> list[Vec3]:
    """Vectors of shape (n, 3) as tuples of Python floats."""
    return list(zip(*vectors.T.tolist(), strict=True))
