"""Curvature of the surface round a contact, from a least-squares sphere, for the contact's patch.

A sphere of curvature c through a contact point satisfies 2 h + c r^2 = 0 for each of its points, at
height h over the tangent plane and distance r from the contact point. The height and the tilt of
the sphere are fitted too, because contact point and normal are means over the pressure, so that the
sphere does not pass through them exactly. The weight of a vertex falls to zero towards the radius
of the fit, so that a vertex that enters or leaves the fit changes the curvature continuously. The
fit of a bulge that other users press into a surface (`search/bulge_fit.py`) has the same kind of
weights.
"""

from __future__ import annotations

import numpy as np

from cohaptic_server.mesh.search.sphere_fit import fit_spheres
from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.numeric import Floats, Ints

FIT_RADIUS = 2.5  # radius of the fit, in contact radii
_MIN_SPACINGS = 3.0  # least radius of the fit on a coarse mesh, in vertex spacings
_SPHERE_ROOM = np.zeros((5, 6))  # scratch memory for the normal equations, reused by each fit


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
    """Fit a sphere to the displaced vertices round each contact, and return its curvature [1/m].

    Args:
        rest: Resting positions of all vertices, shape (v, 3) [m].
        starts: Offsets of the n contacts' parts of `vertices` (row 0) and of `rows` (row 1), shape
            (2 or more, n + 1): part i begins at column i and ends before column i + 1.
        vertices: Vertices whose displacement is known, contact after contact, shape (k,).
        displacement: Displacement of these vertices, shape (k, 3) [m].
        rows: Vertices to which the spheres are fitted, as indices into the contact's part of
            `vertices`, shape (r,).
        points: Contact points, shape (n, 3) [m].
        normals: Outward unit normals at the contact points, shape (n, 3).
        radius: Radius of the fit [m].

    Returns:
        The curvatures, positive where the surface bulges outwards, shape (n,). They are at most
        2 / radius in magnitude, since a sphere smaller than the fitted region has no meaning, and
        zero with fewer than six vertices.
    """
    found = np.empty(len(points))
    fit_spheres(
        rest, starts, vertices, displacement, rows, points, normals, radius, _SPHERE_ROOM, found
    )
    return np.minimum(2.0 / radius, np.maximum(-2.0 / radius, found))


def fit_radius(mesh: SurfaceMesh, contact_radius: float) -> float:
    """Return the radius round a contact point within which vertices enter the fit [m].

    Args:
        contact_radius: Radius of the contact's pressure [m].
    """
    return max(FIT_RADIUS * contact_radius, _MIN_SPACINGS * mesh.spacing())
