"""Where a probe touches a body: the point of the surface, the pressure under it, the normal.

A contact is found on the surface *free of the client's own force*, so that pressing harder does not
move the point that is pressed. It is the point from which the probe lies along the normal, with
point, displacement and normal averaged over the pressure: the nearest point of a faceted surface
jumps from face to face under a probe that sinks in, this one slides. Positions on the surface are
those of the resting mesh; the probe is taken back by the displacement under it.

Facets lie below the surface that they stand for, by half a millimetre on a balloon of 642 vertices.
The contact point is therefore lifted off them, to the smooth surface through the vertices that has
their normals: a hand that slides over it feels no facets, and a client with the resting mesh
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

_LEAST_FIRM = 0.1  # of a way along the surface: there a contact is found as well as can be
_ITERATIONS = 20  # each shortens the way by depth / radius of curvature; two follow a moving hand
_MOST_LEFT = 0.5  # of a step that is believed to be left by the next
_CLOSE = 3e-5  # m along the surface; a hand that moves is followed again in the next tick
# A contact that is known stays until the probe is so far beside it [m]: most ticks of a hand that
# presses then have nothing to find. On a fingertip's curvature it turns the force by 0.2 %.
_STAYS = 6e-5


@dataclass(frozen=True, eq=False)
class Contact:
    """One probe's place on a body.

    Args:
        foot: On a facet of the resting mesh, shape (3,) [m].
        point: On the smooth resting surface above it, shape (3,) [m].
        vertices: Under the pressure, shape (k,).
        weights: Share of each, shape (k,); they sum to 1.
        corners: Vertices of the faces that have one of them, shape (f, 3).
        shares: Of these faces in the normal: the weights at their corners, shape (f,).
        normal: Outward unit normal of the free surface, averaged over the pressure, shape (3,).
        firm: How much nearer the probe comes for a way along the surface, 1 on a plane: at an edge
            under a deep probe the normal turns nearly as fast, and little is left.
    """

    foot: Floats
    point: Floats
    vertices: Ints
    weights: Floats
    corners: Ints
    shares: Floats
    normal: Floats
    firm: float = 1.0

    def load(self, force: float) -> Load:
        """A frictionless press of `force` [N] here."""
        return Load(self.vertices, self.weights, -self.normal, force)

    def moved(self, displacement: Field) -> Floats:
        """The contact point on the surface displaced by `displacement`, shape (3,) [m]."""
        return np.asarray(self.point + self.weights @ displacement[self.vertices])


def locate(
    mesh: SurfaceMesh,
    probe: Floats,
    free: Field,
    *,
    radius: float,
    hint: Contact | None = None,
    exact: float | None = None,
) -> Contact:
    """Find the contact of a probe with the free surface.

    Args:
        mesh: Resting surface.
        probe: Tip, shape (3,) [m].
        free: Displacement of the vertices without this probe's own force.
        radius: Of the pressure [m].
        hint: The contact of the tick before.
        exact: How near along the surface it must be found, in place of what a tick needs [m].
    """
    found, stays = (_CLOSE, _STAYS) if exact is None else (exact, exact)
    if hint is None:
        contact, close = _contact_at(mesh, nearest_point(mesh, probe), free, radius), found
    else:
        # A hand at rest stays here: only the normal can have turned.
        contact, close = turned(mesh, hint, free), stays
    last: Floats | None = None
    firm, stretch = 1.0 if hint is None else hint.firm, 1.0
    for _ in range(_ITERATIONS):
        off = probe - contact.moved(free)
        height = float(off @ contact.normal)
        slide = off - height * contact.normal
        left = 0.0 if last is None else float(slide @ last) / float(last @ last)
        if last is not None and stretch > 0.0:
            firm = min(1.0, max(_LEAST_FIRM, (1.0 - left) / stretch))
        # The way that is left is longer than the probe is beside the normal, where little is firm.
        if np.abs(slide).max() < close * firm:
            break
        close = found
        # What a step left of the one before is what the next would leave of it: go all the way.
        stretch = 1.0 / (1.0 - min(_MOST_LEFT, max(-_MOST_LEFT, left)))
        # Above a round body the way along the surface is shorter than it looks from the probe.
        # Below, steps grow shorter towards its middle: beyond that, what is nearest lies on the
        # other side, and a hand that was driven through stays with the wall that it came from.
        if height >= 0.0:
            stretch /= 1.0 + height / mesh.size
        else:
            stretch *= max(0.0, 1.0 + height / mesh.size)
        last, way = slide, stretch * slide
        contact = _contact_at(mesh, nearest_point(mesh, contact.foot + way), free, radius)
    return contact if contact.firm == firm else replace(contact, firm=firm)


def turned(mesh: SurfaceMesh, contact: Contact, free: Field) -> Contact:
    """The same place with the normal that it has on a surface displaced by `free`."""
    return replace(contact, normal=_normal(mesh, contact.corners, contact.shares, free))


def _contact_at(mesh: SurfaceMesh, foot: Floats, free: Field, radius: float) -> Contact:
    vertices, weights = pressure(mesh, foot, radius)
    point = smooth_point(mesh, foot, vertices, weights)
    corners = mesh.faces[np.unique(mesh.rings[vertices])]
    place = np.minimum(np.searchsorted(vertices, corners), len(vertices) - 1)
    shares = np.where(vertices[place] == corners, weights[place], 0.0).sum(axis=1)
    normal = _normal(mesh, corners, shares, free)
    return Contact(foot, point, vertices, weights, corners, shares, normal)


def _normal(mesh: SurfaceMesh, corners: Ints, shares: Floats, free: Field) -> Floats:
    """Unit normal of the displaced surface, averaged over the pressure, shape (3,)."""
    moved = mesh.vertices[corners] + free[corners]  # (f, 3, 3)
    vectors = cross(moved[:, 1] - moved[:, 0], moved[:, 2] - moved[:, 0])
    normal = shares @ vectors
    return np.asarray(normal / math.sqrt(normal @ normal))


REACH = 0.03  # m above the surface: further off a probe carries no force
