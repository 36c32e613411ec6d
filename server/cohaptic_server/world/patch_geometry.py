"""From the plane at a contact to the geometry that a user asked for."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from cohaptic.protocol.patch import Geometry, Patch
from cohaptic_server.bodies.touched_body import TouchedBody
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.world import curvature, neighbourhood
from cohaptic_server.world.contact import Contact
from cohaptic_server.world.displacement_field import CachedField

# A window reaches this far beyond the pressure, because a contact moves before the next tick: the
# sum of a length and a number of vertex spacings.
_MARGIN = 0.005  # m
_MARGIN_SPACINGS = 3.0
_REUSE_DISTANCE = 0.002  # m that a contact moves before its window is chosen anew, within `_MARGIN`
# Ratio of a distance at rest to the same distance on the displaced surface, which may have brought
# vertices nearer.
_MAX_COMPRESSION = 1.3


@dataclass(frozen=True, eq=False)
class ContactWindow:
    """Vertices round one contact at which a tick evaluates the free surface.

    Args:
        geometry: Of the patch.
        foot: Of the contact on the resting surface, shape (3,) [m].
        slide: Distance that the probe slides while the patch is in use, shape (3,) [m].
        horizon: Time for which the patch is in use [s].
        vertices: Of the surface, ascending, shape (k,).
        touched: Vertices of the touch mesh that a mesh patch carries, ascending; empty for other
            geometries.
    """

    geometry: Geometry
    foot: Floats
    slide: Floats
    horizon: float
    vertices: Ints
    touched: Ints

    def __post_init__(self) -> None:
        # A body may cache its answers by the identity of this array, tick after tick.
        self.vertices.setflags(write=False)

    def covers(self, contact: Contact, slide: Floats, horizon: float) -> bool:
        """Whether this window still covers the contact."""
        moved = np.abs(contact.foot - self.foot).max()
        turned = np.abs(slide - self.slide).max()
        widened = neighbourhood.SPEEDING_UP * abs(horizon - self.horizon)
        return bool(max(moved, turned, widened) <= _REUSE_DISTANCE)


def choose_window(
    touched_body: TouchedBody,
    geometry: Geometry,
    contact: Contact,
    velocity: Floats,
    horizon: float,
    previous: ContactWindow | None,
) -> ContactWindow:
    """Choose the vertices round one contact; those of the last tick where they still cover it.

    Args:
        touched_body: The deformable object and its touch mesh.
        geometry: Of the patch.
        contact: Of the probe.
        velocity: Of the probe, shape (3,) [m/s].
        horizon: Time for which the patch will be in use [s].
        previous: Window of the last tick; None without one.
    """
    tangential = velocity - (velocity @ contact.normal) * contact.normal
    slide = horizon * tangential
    if (
        previous is not None
        and previous.geometry is geometry
        and previous.covers(contact, slide, horizon)
    ):
        return previous
    body = touched_body.body
    mesh, foot = body.mesh, contact.foot
    radius = body.contact_radius + _MARGIN + _MARGIN_SPACINGS * mesh.spacing()
    vertices, touched = mesh.near(foot, radius), np.zeros(0, dtype=np.int64)
    if geometry is not Geometry.PLANE:
        touch = touched_body.mesh
        if geometry is Geometry.MESH:
            touched = neighbourhood.choose_vertices(touch, foot, tangential, horizon)
        fitted = _MAX_COMPRESSION * curvature.fit_radius(mesh, body.contact_radius)
        shape = touch.vertices[np.union1d(touch.near(foot, fitted), touched)]
        vertices = np.union1d(vertices, shape)
    return ContactWindow(geometry, foot, slide, horizon, vertices, touched)


def with_geometry(
    plane: Patch, touched_body: TouchedBody, window: ContactWindow, free: CachedField
) -> Patch:
    """Add the shape of the free surface round a contact to its patch.

    A mesh patch carries the curvature as well, for a probe beyond the end of its neighbourhood.

    Args:
        plane: Patch of the contact.
        touched_body: The deformable object and its touch mesh.
        window: Of the contact; its geometry is the one that is made.
        free: Displacement there without the user's own force.
    """
    geometry = window.geometry
    if geometry is Geometry.PLANE:
        return plane
    x_free, normal = np.array(plane.x_free), np.array(plane.normal)
    body = touched_body.body
    vertices = touched_body.mesh.among(free.vertices)
    points = body.mesh.vertices[vertices] + free[vertices]
    radius = curvature.fit_radius(body.mesh, body.contact_radius)
    fitted = curvature.fit_curvature(points, x_free, normal, radius)
    if geometry is Geometry.SPHERE:
        return replace(plane, geometry=geometry, curvature=fitted)
    near = neighbourhood.cut_neighbourhood(touched_body, free, window.touched)
    return replace(plane, geometry=geometry, curvature=fitted, neighbourhood=near)
