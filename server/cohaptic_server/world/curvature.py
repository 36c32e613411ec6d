"""Curvature of the free surface around a contact, for sphere patches: one number by least squares.

A sphere of curvature c through a point with normal n has 2 h + c r^2 = 0 for each of its points at
height h over the tangent plane and distance r from the point. The fit leaves a height and a tilt
free beside c, since point and normal are means over the pressure: what is left is the bending.
"""

from __future__ import annotations

import numpy as np

from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.numeric import Floats

REACH = 2.5  # contact radii round the contact that the sphere is fitted to
_SPACINGS = 3.0  # the same in distances between vertices, on a coarse mesh
_TINY = 1e-10
_LEAST = 6  # points; a sphere with height and tilt has four unknowns


def fit_curvature(points: Floats, at: Floats, normal: Floats, reach: float) -> float:
    """Curvature of the sphere nearest to the points, positive where they bulge [1/m].

    Points count less towards `reach`, so that none of them comes or goes with a step.

    Args:
        points: Of the surface, shape (k, 3) [m].
        at: Where the sphere touches, shape (3,) [m].
        normal: Outward unit normal there, shape (3,).
        reach: How far round `at` points count [m].
    """
    gap = points - at
    height = gap @ normal
    # The other side of a thin body is near, too.
    square = np.einsum("ki,ki->k", gap, gap)
    share = 1.0 - square / reach**2
    used = share > 0.0
    if used.sum() < _LEAST:
        return 0.0
    gap, height, square, weight = gap[used], height[used], square[used], share[used]
    columns = np.empty((len(gap), 5))  # bending, height, tilt (of which one way does not count)
    columns[:, 0] = square / reach**2
    columns[:, 1] = 1.0
    columns[:, 2:] = (gap - height[:, None] * normal) / reach
    weighted = columns * weight[:, None] ** 2
    square_of_columns: Floats = weighted.T @ columns
    # The tilt along the normal is no unknown, and points in a row leave more undetermined: the
    # least solution leaves out what nothing speaks for.
    square_of_columns[np.diag_indices(5)] += _TINY * max(1e-9, np.trace(square_of_columns))
    right: Floats = weighted.T @ height
    solution = np.asarray(np.linalg.solve(square_of_columns, right), dtype=np.float64)
    # A sphere smaller than what it is fitted to says nothing.
    curvature = -2.0 * float(solution[0]) / reach**2
    return min(2.0 / reach, max(-2.0 / reach, curvature))


def reach(mesh: SurfaceMesh, contact_radius: float) -> float:
    """How far round a contact the sphere is fitted [m]."""
    return max(REACH * contact_radius, _SPACINGS * mesh.spacing())
