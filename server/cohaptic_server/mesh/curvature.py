"""Curvature of the surface round a contact, by a least-squares sphere, for the contact's patch.

A sphere of curvature c through a point with normal n satisfies 2 h + c r^2 = 0 for each of its
points, at height h over the tangent plane and distance r from the point. Height and tilt are fitted
beside c, because the given point and normal are means over the pressure and do not lie exactly on
the surface. The weight of a point falls to zero towards the fit's radius, so that a point that
enters or leaves the fit changes the curvature continuously. The fit of a bulge that other users
press into a surface (`search/bulge_fit.py`) has the same kind of weights.
"""

from __future__ import annotations

import numpy as np

from cohaptic_server.mesh.search.sphere_fit import fit_spheres
from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.numeric import Floats, Ints

FIT_RADIUS = 2.5  # contact radii round the contact from which points are fitted
_MIN_SPACINGS = 3.0  # vertex spacings; least radius of the fit on a coarse mesh
_SPHERE_ROOM = np.zeros((5, 6))  # room for the equations, used by each fit in turn


def fit_curvatures(
    rest: Floats,
    starts: Ints,
    vertices: Ints,
    displacement: Floats,
    rows: Ints,
    points: Floats,
    normals: Floats,
    radius: float,
) -> Floats:
    """Curvature of the sphere nearest to displaced vertices, positive where they bulge [1/m].

    Args:
        rest: Resting positions of all vertices, shape (v, 3) [m].
        starts: Index at which the part of each of n contacts begins, and index at which the last
            part ends: in `vertices` (first row) and in `rows` (second row), shape (2 or more,
            n + 1).
        vertices: Vertices whose displacement is known, shape (k,).
        displacement: Displacement of these vertices, shape (k, 3) [m].
        rows: Vertices that are fitted, as indices into the contact's part of `vertices`, shape
            (r,).
        points: Contact points, shape (n, 3) [m].
        normals: Outward unit normals at the contact points, shape (n, 3).
        radius: Radius of the fit [m].

    Returns:
        The curvatures, shape (n,), at most 2 / radius in magnitude, since a sphere smaller than the
        fitted region has no meaning. Zero with fewer than six points.
    """
    found = np.empty(len(points))
    fit_spheres(
        rest, starts, vertices, displacement, rows, points, normals, radius, _SPHERE_ROOM, found
    )
    return np.minimum(2.0 / radius, np.maximum(-2.0 / radius, found))


def fit_radius(mesh: SurfaceMesh, contact_radius: float) -> float:
    """Radius round a contact within which the sphere is fitted [m]."""
    return max(FIT_RADIUS * contact_radius, _MIN_SPACINGS * mesh.spacing())
