"""From the plane at a contact to the geometry that a user asked for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cohaptic.protocol.neighbourhood import MAX_VERTICES, Neighbourhood
from cohaptic.protocol.patch import Geometry
from cohaptic.vec import Vec3, dot, norm, scale, sub
from cohaptic_server.bodies.touched_body import TouchedBody
from cohaptic_server.mesh import curvature
from cohaptic_server.mesh.contact_windows import Chosen
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.world import neighbourhood
from cohaptic_server.world.contact import Contact

# A window reaches this far beyond the pressure, because a contact moves before the next tick: the
# sum of a length and a number of vertex spacings.
_MARGIN = 0.005  # m
_MARGIN_SPACINGS = 3.0
_REUSE_DISTANCE = 0.002  # m that a contact moves before its window is chosen anew, within `_MARGIN`
# Ratio of a distance at rest to the same distance on the displaced surface, which may have brought
# vertices nearer.
_MAX_COMPRESSION = 1.3
_NOTHING = (np.zeros(0, dtype=np.int64),) * 3  # fitted, touched, carried


@dataclass(frozen=True, eq=False, slots=True)
class ContactWindow:
    """Vertices round one contact at which a tick evaluates the free surface.

    Args:
        geometry: Of the patch.
        foot: Of the contact on the resting surface [m].
        slide: Distance that the probe slides while the patch is in use [m].
        horizon: Time for which the patch is in use [s].
        vertices: Of the surface, ascending, shape (k,).
        fitted: Those of them that the touch mesh has, as indices into `vertices`, shape (r,); empty
            for a plane.
        touched: Vertices of the touch mesh that a mesh patch carries, ascending, shape (t,); empty
            for other geometries.
        carried: The same as indices into `vertices`, shape (t,).
    """

    geometry: Geometry
    foot: Vec3
    slide: Vec3
    horizon: float
    vertices: Ints
    fitted: Ints
    touched: Ints
    carried: Ints

    def covers(self, foot: Vec3, slide: Vec3, horizon: float) -> bool:
        """Whether this window still covers a contact."""
        moved, turned = sub(foot, self.foot), sub(slide, self.slide)
        widened = neighbourhood.SPEEDING_UP * abs(horizon - self.horizon)
        return max(widened, *map(abs, moved), *map(abs, turned)) <= _REUSE_DISTANCE


def choose_window(
    touched_body: TouchedBody,
    geometry: Geometry,
    contact: Contact,
    velocity: Vec3,
    horizon: float,
    previous: ContactWindow | None,
) -> ContactWindow:
    """Choose the vertices round one contact; those of the last tick where they still cover it.

    Args:
        touched_body: The deformable object and its touch mesh.
        geometry: Of the patch.
        contact: Of the probe.
        velocity: Of the probe [m/s].
        horizon: Time for which the patch will be in use [s].
        previous: Window of the last tick; None without one.
    """
    foot, _, normal = contact.places
    tangential = sub(velocity, scale(normal, dot(velocity, normal)))
    slide = scale(tangential, horizon)
    if (
        previous is not None
        and previous.geometry is geometry
        and previous.covers(foot, slide, horizon)
    ):
        return previous
    body = touched_body.body
    mesh = body.mesh
    radius = body.contact_radius + _MARGIN + _MARGIN_SPACINGS * mesh.spacing()
    if geometry is Geometry.PLANE:
        chosen = Chosen(mesh.near(contact.foot, radius), *_NOTHING)
    else:
        length, width = neighbourhood.path_ahead(touched_body.mesh, norm(tangential), horizon)
        chosen = touched_body.windows.choose(
            contact.foot,
            contact.normal,
            radius,
            _MAX_COMPRESSION * curvature.fit_radius(mesh, body.contact_radius),
            (np.array(tangential), length, width),
            MAX_VERTICES if geometry is Geometry.MESH else 0,
        )
    # A body may cache its answers by the identity of this array, tick after tick.
    chosen.vertices.setflags(write=False)
    return ContactWindow(geometry, foot, slide, horizon, *chosen)


def free_shape(
    touched_body: TouchedBody,
    window: ContactWindow,
    displacement: Floats,
    x_free: Vec3,
    normal: Vec3,
) -> tuple[float, Neighbourhood | None]:
    """Curvature [1/m] and neighbourhood of the free surface round a contact, for its patch.

    A plane has neither. A mesh patch carries the curvature as well, for a probe beyond the end of
    its neighbourhood.

    Args:
        touched_body: The deformable object and its touch mesh.
        window: Of the contact; its geometry is the one that is made.
        displacement: At its vertices without the user's own force, shape (k, 3) [m].
        x_free: Contact point on that surface [m].
        normal: Outward unit normal there.
    """
    if window.geometry is Geometry.PLANE:
        return 0.0, None
    body = touched_body.body
    fitted = curvature.fit_curvature(
        body.mesh.vertices,
        window.vertices,
        displacement,
        window.fitted,
        np.array([x_free, normal]),
        curvature.fit_radius(body.mesh, body.contact_radius),
    )
    if window.geometry is Geometry.SPHERE:
        return fitted, None
    carried = displacement[window.carried]
    return fitted, neighbourhood.cut_neighbourhood(touched_body, carried, window.touched)
