"""From the plane at a contact to the geometry that a user asked for."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from cohaptic.protocol.patch import Geometry, Patch
from cohaptic_server.bodies.touched_body import TouchedBody
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.world import curvature, neighbourhood
from cohaptic_server.world.contact import Contact
from cohaptic_server.world.displacement_field import Window

_AROUND = 0.005  # m beyond the pressure, for a contact that moves before the next tick
_SPACINGS = 3.0  # the same in distances between vertices
_SLACK = 0.002  # m that a finger moves before it is looked anew: `_AROUND` has room for it
# A surface that is displaced may bring vertices nearer than they are at rest.
_STRAIN = 1.3


@dataclass(frozen=True, eq=False)
class Sight:
    """What a tick looks at round one contact.

    Args:
        geometry: Of the patch.
        foot: Of the contact on the resting surface, shape (3,) [m].
        way: How far the probe slides while the patch is in use, shape (3,) [m].
        horizon: For how long that is [s].
        vertices: Of the surface, rising, shape (k,).
        touched: Of the touch mesh, those of the patch, rising; none but for a mesh patch.
    """

    geometry: Geometry
    foot: Floats
    way: Floats
    horizon: float
    vertices: Ints
    touched: Ints

    def __post_init__(self) -> None:
        # What is looked at tick after tick may be remembered by what it is.
        self.vertices.setflags(write=False)

    def does(self, contact: Contact, way: Floats, horizon: float) -> bool:
        """Whether it does for a finger that has hardly moved since."""
        moved = np.abs(contact.foot - self.foot).max()
        turned = np.abs(way - self.way).max()
        more = neighbourhood.SPEEDING_UP * abs(horizon - self.horizon)
        return bool(max(moved, turned, more) <= _SLACK)


def look(
    touched_body: TouchedBody,
    geometry: Geometry,
    contact: Contact,
    velocity: Floats,
    horizon: float,
    before: Sight | None,
) -> Sight:
    """What a tick looks at round one contact.

    Args:
        touched_body: The deformable object and its touch mesh.
        geometry: Of the patch.
        contact: Of the probe.
        velocity: Of the probe, shape (3,) [m/s].
        horizon: For how long the patch will be in use [s].
        before: What the last tick looked at.
    """
    slide = velocity - (velocity @ contact.normal) * contact.normal
    way = horizon * slide
    if before is not None and before.geometry is geometry and before.does(contact, way, horizon):
        return before
    body = touched_body.body
    mesh, foot = body.mesh, contact.foot
    around = body.contact_radius + _AROUND + _SPACINGS * mesh.spacing()
    vertices, touched = mesh.near(foot, around), np.zeros(0, dtype=np.int64)
    if geometry is not Geometry.PLANE:
        touch = touched_body.mesh
        if geometry is Geometry.MESH:
            touched = neighbourhood.choose_vertices(touch, foot, slide, horizon)
        bends = _STRAIN * curvature.reach(mesh, body.contact_radius)
        beyond = touch.vertices[np.union1d(touch.near(foot, bends), touched)]
        vertices = np.union1d(vertices, beyond)
    return Sight(geometry, foot, way, horizon, vertices, touched)


def with_shape(patch: Patch, touched_body: TouchedBody, sight: Sight, free: Window) -> Patch:
    """The patch with the surface round its contact, as it is without the user's own force.

    A mesh patch has the curvature too: it serves where the neighbourhood ends.

    Args:
        patch: A plane.
        touched_body: The deformable object and its touch mesh.
        sight: What the tick looks at.
        free: The surface there without the user's own force.
    """
    geometry = sight.geometry
    if geometry is Geometry.PLANE:
        return patch
    at, normal = np.array(patch.x_free), np.array(patch.normal)
    body = touched_body.body
    vertices = touched_body.mesh.among(free.vertices)
    points = body.mesh.vertices[vertices] + free[vertices]
    reach = curvature.reach(body.mesh, body.contact_radius)
    bending = curvature.fit_curvature(points, at, normal, reach)
    if geometry is Geometry.SPHERE:
        return replace(patch, geometry=geometry, curvature=bending)
    near = neighbourhood.cut_neighbourhood(touched_body, free, sight.touched)
    return replace(patch, geometry=geometry, curvature=bending, neighbourhood=near)
