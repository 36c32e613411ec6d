"""Contact of a probe with a body: its point on the surface, the pressure under it, the normal.

A contact is found on the surface *free of the client's own force*, so that pressing harder does not
move the contact point. It is the point from which the probe lies along the normal, with point,
displacement and normal averaged over the pressure. The nearest point of a faceted surface would
jump from face to face under a probe that sinks in; the average slides. Points of the surface are
given on the resting mesh, and the probe is taken back by the displacement there.

Facets lie below the smooth surface that they approximate, by half a millimetre on a balloon of 642
vertices. The contact point is therefore lifted to the smooth surface through the vertices with
their normals, so that a hand that slides feels no facets; a client with the resting mesh
(`mesh_surface.py`) finds the same surface.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from cohaptic_server.bodies.body import Load
from cohaptic_server.mesh.nearest import (
    nearest_point,
)
from cohaptic_server.mesh.pressure import pressure, smooth_point
from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.numeric import Floats, Ints, cross
from cohaptic_server.world.displacement_field import Field

MAX_CONTACT_HEIGHT = 0.03  # m above the surface; a probe higher up applies no force
_MIN_SLOPE = 0.1  # lower bound of `Contact.slope`; keeps the stopping distance positive
# Each iteration shortens the offset by depth / radius of curvature; two follow a moving hand.
_MAX_ITERATIONS = 20
_MAX_RATIO = 0.5  # largest ratio of two successive offsets that Aitken extrapolation trusts
_TOLERANCE = 3e-5  # m along the surface; a hand that moves is followed again in the next tick
# m beside the normal within which a previous contact is kept, so that most ticks of a pressing hand
# have nothing to search. On a fingertip's curvature it turns the force by 0.2 %.
_KEEP_DISTANCE = 6e-5


@dataclass(frozen=True, eq=False)
class Contact:
    """Contact of one probe with a body.

    Args:
        foot: Point on a facet of the resting mesh, shape (3,) [m].
        point: Contact point on the smooth resting surface above it, shape (3,) [m].
        vertices: Under the pressure, shape (k,).
        weights: Share of each vertex in the pressure, shape (k,); they sum to 1.
        corners: Vertices of the faces that have one of `vertices`, shape (f, 3).
        shares: Weight of each of these faces in the normal, the sum of its corners', shape (f,).
        normal: Outward unit normal of the free surface, averaged over the pressure, shape (3,).
        slope: Decrease of the probe's offset beside the normal per distance that the contact moves
            along the surface: 1 on a plane, and less where the normal turns, such as at an edge
            under a deep probe.
    """

    foot: Floats
    point: Floats
    vertices: Ints
    weights: Floats
    corners: Ints
    shares: Floats
    normal: Floats
    slope: float = 1.0

    def load(self, force: float) -> Load:
        """Load of a frictionless press with `force` [N]."""
        return Load(self.vertices, self.weights, -self.normal, force)

    def moved(self, displacement: Field) -> Floats:
        """Contact point on the surface displaced by `displacement`, shape (3,) [m]."""
        return np.asarray(self.point + self.weights @ displacement[self.vertices])


def locate(
    mesh: SurfaceMesh,
    probe: Floats,
    free: Field,
    *,
    radius: float,
    hint: Contact | None = None,
    tolerance: float | None = None,
) -> Contact:
    """Find the contact of a probe with the free surface.

    Args:
        mesh: Resting surface.
        probe: Tip, shape (3,) [m].
        free: Displacement of the vertices without this probe's own force.
        radius: Of the pressure [m].
        hint: Contact of the last tick; None to search the whole surface.
        tolerance: Distance along the surface to which the contact is found [m]; None for that of a
            tick.
    """
    final, keep = (_TOLERANCE, _KEEP_DISTANCE) if tolerance is None else (tolerance, tolerance)
    if hint is None:
        contact, limit = _contact_at(mesh, nearest_point(mesh, probe), free, radius), final
    else:
        # For a hand at rest the contact stays, and only the normal can have turned.
        contact, limit = turned(mesh, hint, free), keep
    previous: Floats | None = None
    slope, factor = 1.0 if hint is None else hint.slope, 1.0
    for _ in range(_MAX_ITERATIONS):
        gap = probe - contact.moved(free)
        height = float(gap @ contact.normal)
        offset = gap - height * contact.normal
        ratio = 0.0 if previous is None else float(offset @ previous) / float(previous @ previous)
        if previous is not None and factor > 0.0:
            slope = min(1.0, max(_MIN_SLOPE, (1.0 - ratio) / factor))
        # With a small slope the contact is further from its solution than the offset says.
        if np.abs(offset).max() < limit * slope:
            break
        limit = final
        # Aitken extrapolation of a linearly converging step.
        factor = 1.0 / (1.0 - min(_MAX_RATIO, max(-_MAX_RATIO, ratio)))
        # Outside a round body the distance along the surface is shorter than the probe's offset.
        # Inside, steps shrink to zero at the centre, since beyond it the nearest point lies on the
        # far side: a hand that was driven through the body stays with the wall that it came from.
        if height >= 0.0:
            factor /= 1.0 + height / mesh.size
        else:
            factor *= max(0.0, 1.0 + height / mesh.size)
        previous, step = offset, factor * offset
        contact = _contact_at(mesh, nearest_point(mesh, contact.foot + step), free, radius)
    return contact if contact.slope == slope else replace(contact, slope=slope)


def turned(mesh: SurfaceMesh, contact: Contact, free: Field) -> Contact:
    """The same contact with its normal on a surface displaced by `free`."""
    return replace(contact, normal=_normal(mesh, contact.corners, contact.shares, free))


def _contact_at(mesh: SurfaceMesh, foot: Floats, free: Field, radius: float) -> Contact:
    vertices, weights = pressure(mesh, foot, radius)
    point = smooth_point(mesh, foot, vertices, weights)
    corners = mesh.faces[np.unique(mesh.rings[vertices])]
    index = np.minimum(np.searchsorted(vertices, corners), len(vertices) - 1)
    shares = np.where(vertices[index] == corners, weights[index], 0.0).sum(axis=1)
    normal = _normal(mesh, corners, shares, free)
    return Contact(foot, point, vertices, weights, corners, shares, normal)


def _normal(mesh: SurfaceMesh, corners: Ints, shares: Floats, free: Field) -> Floats:
    """Unit normal of the displaced surface, averaged over the pressure, shape (3,)."""
    displaced = mesh.vertices[corners] + free[corners]  # (f, 3, 3)
    area = cross(displaced[:, 1] - displaced[:, 0], displaced[:, 2] - displaced[:, 0])
    normal = shares @ area
    return np.asarray(normal / math.sqrt(normal @ normal))
