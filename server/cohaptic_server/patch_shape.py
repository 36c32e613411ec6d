"""From the plane at a contact to the geometry that a user asked for."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from cohaptic.protocol.patch import Geometry, Patch
from cohaptic_server import curvature, neighbourhood
from cohaptic_server.bodies.body import Body
from cohaptic_server.bodies.mesh import Floats, Ints
from cohaptic_server.field import Window
from cohaptic_server.touch_mesh import touch_mesh

_AROUND = 0.005  # m beyond the pressure, for a contact that moves before the next tick
_SPACINGS = 3.0  # the same in distances between vertices
# A surface that is displaced may bring vertices nearer than they are at rest.
_STRAIN = 1.3


@dataclass(frozen=True, slots=True)
class Sight:
    """How far round a contact a tick looks at the free surface.

    Args:
        whole: At every vertex [m].
        touch: At those of the touch mesh [m]; 0 where no mesh patch is asked for.
    """

    whole: float = 0.0
    touch: float = 0.0

    def vertices(self, body: Body, foot: Floats) -> Ints:
        """What is seen round a point of the resting surface, rising, shape (k,)."""
        if self.touch <= 0.0:
            return body.mesh.near(foot, self.whole)
        mesh = touch_mesh(body)
        if len(mesh.vertices) == len(body.mesh.vertices):
            return body.mesh.near(foot, max(self.whole, self.touch))
        return np.union1d(body.mesh.near(foot, self.whole), mesh.near(foot, self.touch))


def sight(body: Body, geometry: Geometry, velocity: Floats, horizon: float) -> Sight:
    """How far round a contact a tick looks at the free surface.

    Args:
        body: That is touched.
        geometry: Of the patch.
        velocity: Of the probe, shape (3,) [m/s].
        horizon: For how long the patch will be in use [s].
    """
    mesh = body.mesh
    whole = body.contact_radius + _AROUND + _SPACINGS * curvature.spacing(mesh)
    if geometry is Geometry.PLANE:
        return Sight(whole)
    whole = max(whole, _STRAIN * curvature.reach(mesh, body.contact_radius))
    if geometry is Geometry.SPHERE:
        return Sight(whole)
    speed = math.sqrt(float(velocity @ velocity))
    return Sight(whole, _STRAIN * neighbourhood.reach(touch_mesh(body), speed, horizon))


def with_shape(
    patch: Patch, geometry: Geometry, body: Body, free: Window, velocity: Floats, horizon: float
) -> Patch:
    """The patch with the surface round its contact, as it is without the user's own force.

    A mesh patch has the curvature too: it serves where the neighbourhood ends.

    Args:
        patch: A plane.
        geometry: Wanted.
        body: The deformable object.
        free: The surface round the contact without the user's own force.
        velocity: Of the probe, shape (3,) [m/s].
        horizon: For how long the patch will be in use [s].
    """
    if geometry is Geometry.PLANE:
        return patch
    at, normal = np.array(patch.x_free), np.array(patch.normal)
    points = body.mesh.vertices[free.vertices] + free.values
    reach = curvature.reach(body.mesh, body.contact_radius)
    bending = curvature.fit_curvature(points, at, normal, reach)
    if geometry is Geometry.SPHERE:
        return replace(patch, geometry=geometry, curvature=bending)
    near = neighbourhood.cut_neighbourhood(body, free, at, normal, velocity, horizon)
    return replace(patch, geometry=geometry, curvature=bending, neighbourhood=near)
