"""Curvature of the free surface round a contact, for sphere patches: one number by least squares.

A sphere of curvature c through a point with normal n satisfies 2 h + c r^2 = 0 for each of its
points, at height h over the tangent plane and distance r from the point. Height and tilt are fitted
beside c, because the given point and normal are means over the pressure and do not lie exactly on
the surface.
"""

from __future__ import annotations

import numpy as np

from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.numeric import Floats

FIT_RADIUS = 2.5  # contact radii round the contact from which points are fitted
_MIN_SPACINGS = 3.0  # vertex spacings; least radius of the fit on a coarse mesh
_TIKHONOV = 1e-10  # relative to the mean of the normal matrix's diagonal
_MIN_POINTS = 6  # a sphere with height and tilt has four unknowns


def fit_curvature(points: Floats, x_free: Floats, normal: Floats, radius: float) -> float:
    """Curvature of the sphere nearest to the points, positive where they bulge [1/m].

    The weight of a point falls to zero towards `radius`, so that a point that enters or leaves the
    fit changes the curvature continuously.

    Args:
        points: Of the surface, shape (k, 3) [m].
        x_free: Contact point, shape (3,) [m].
        normal: Outward unit normal there, shape (3,).
        radius: Of the fit [m].

    Returns:
        The curvature, at most 2 / radius: a sphere smaller than the fitted region has no meaning.
        Zero with fewer than six points.
    """
    offset = points - x_free
    height = offset @ normal
    # With the height: points on the far side of a thin body are close in the tangent plane.
    square = np.einsum("ki,ki->k", offset, offset)
    weight = 1.0 - square / radius**2
    used = weight > 0.0
    if used.sum() < _MIN_POINTS:
        return 0.0
    offset, height, square, weight = offset[used], height[used], square[used], weight[used]
    design = np.empty((len(offset), 5))  # curvature, height, and tilt as a vector in the plane
    design[:, 0] = square / radius**2
    design[:, 1] = 1.0
    design[:, 2:] = (offset - height[:, None] * normal) / radius
    weighted = design * weight[:, None] ** 2
    normal_matrix: Floats = weighted.T @ design
    # The tilt along the normal is undetermined, and so are more unknowns if the points lie in a
    # row; the Tikhonov term sets those to zero.
    normal_matrix[np.diag_indices(5)] += _TIKHONOV * max(1e-9, np.trace(normal_matrix))
    right: Floats = weighted.T @ height
    solution = np.asarray(np.linalg.solve(normal_matrix, right), dtype=np.float64)
    curvature = -2.0 * float(solution[0]) / radius**2
    return min(2.0 / radius, max(-2.0 / radius, curvature))


def fit_radius(mesh: SurfaceMesh, contact_radius: float) -> float:
    """Radius round a contact within which the sphere is fitted [m]."""
    return max(FIT_RADIUS * contact_radius, _MIN_SPACINGS * mesh.spacing())
