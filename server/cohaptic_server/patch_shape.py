"""From the plane at a contact to the geometry that a user asked for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cohaptic.protocol.patch import Geometry, Patch
from cohaptic_server.bodies.body import Body
from cohaptic_server.bodies.mesh import Floats
from cohaptic_server.curvature import contact_curvature
from cohaptic_server.neighbourhood import cut_neighbourhood


def with_shape(
    patch: Patch, geometry: Geometry, body: Body, free: Floats, velocity: Floats, horizon: float
) -> Patch:
    """The patch with the surface round its contact, as it is without the user's own force.

    A mesh patch has the curvature too: it serves where the neighbourhood ends.

    Args:
        patch: A plane.
        geometry: Wanted.
        body: The deformable object.
        free: Displacement without the user's own force, shape (n, 3) [m].
        velocity: Of the probe, shape (3,) [m/s].
        horizon: For how long the patch will be in use [s].
    """
    if geometry is Geometry.PLANE:
        return patch
    at, normal = np.array(patch.x_free), np.array(patch.normal)
    curvature = contact_curvature(body.mesh, free, at, normal, body.contact_radius)
    if geometry is Geometry.SPHERE:
        return replace(patch, geometry=geometry, curvature=curvature)
    near = cut_neighbourhood(body, free, at, normal, velocity, horizon)
    return replace(patch, geometry=geometry, curvature=curvature, neighbourhood=near)
