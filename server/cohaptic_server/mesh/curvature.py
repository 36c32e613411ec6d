"""Curvature round a contact by least squares: of a sphere for its patch, and of a bulge.

A sphere of curvature c through a point with normal n satisfies 2 h + c r^2 = 0 for each of its
points, at height h over the tangent plane and distance r from the point. Height and tilt are fitted
beside c, because the given point and normal are means over the pressure and do not lie exactly on
the surface. The weight of a point falls to zero towards the fit's radius, so that a point that
enters or leaves the fit changes the curvature continuously. The same holds for a bulge, which is
what others press into a surface.
"""

from __future__ import annotations

import numpy as np

from cohaptic_server.mesh.search.bulge_fit import fit_bulge
from cohaptic_server.mesh.search.sphere_fit import fit_sphere
from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.numeric import Floats, Ints

FIT_RADIUS = 2.5  # contact radii round the contact from which points are fitted
_MIN_SPACINGS = 3.0  # vertex spacings; least radius of the fit on a coarse mesh
_ROOM = np.zeros((5, 6))  # for the equations of one fit after the other
_BULGE_ROOM = np.zeros((6, 8))


def fit_curvature(
    rest: Floats, vertices: Ints, displacement: Floats, rows: Ints, frame: Floats, radius: float
) -> float:
    """Curvature of the sphere nearest to displaced vertices, positive where they bulge [1/m].

    Args:
        rest: Resting positions of all vertices, shape (n, 3) [m].
        vertices: Those whose displacement is known, shape (k,).
        displacement: Of these, shape (k, 3) [m].
        rows: Those of `vertices` that are fitted, as indices into them, shape (r,).
        frame: Contact point and outward unit normal there, shape (2, 3).
        radius: Of the fit [m].

    Returns:
        The curvature, at most 2 / radius: a sphere smaller than the fitted region has no meaning.
        Zero with fewer than six points.
    """
    curvature = fit_sphere(rest, vertices, displacement, rows, frame, radius, _ROOM)
    return min(2.0 / radius, max(-2.0 / radius, curvature))


def fit_radius(mesh: SurfaceMesh, contact_radius: float) -> float:
    """Radius round a contact within which the sphere is fitted [m]."""
    return max(FIT_RADIUS * contact_radius, _MIN_SPACINGS * mesh.spacing())


def bulge(
    mesh: SurfaceMesh, vertices: Ints, displacement: Floats, frame: Floats, contact_radius: float
) -> float:
    """Largest outward curvature that a displacement adds to the surface round a contact [1/m].

    Args:
        mesh: Resting surface.
        vertices: Those whose displacement is known, shape (k,).
        displacement: Of these, shape (k, 3) [m].
        frame: Foot, point and normal of the contact, shape (3, 3).
        contact_radius: Of its pressure [m].
    """
    radius = fit_radius(mesh, contact_radius)
    return fit_bulge(
        mesh.vertices, mesh.normals, vertices, displacement, frame, radius, _BULGE_ROOM
    )
