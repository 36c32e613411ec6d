"""Curvature of the bulge that a displacement field makes in a surface, for `free_surfaces.py`."""

from __future__ import annotations

import math

from cohaptic_server.numeric import Floats, Ints

_UNKNOWNS = 6  # of a quadratic in two coordinates; its second derivatives come first
_TIKHONOV = 1e-10  # relative to the normal matrix's trace
_POINT, _NORMAL = 1, 2  # rows of a contact's frame


# One pass over the vertices with the axes of the contact, which are nine numbers.
def fit_bulge(
    rest: Floats,
    normals: Floats,
    vertices: Ints,
    displacement: Floats,
    frame: Floats,
    radius: float,
    matrix: Floats,
) -> float:
    """Return the largest outward curvature that a displacement gives to a plane round a contact.

    The displacement along the contact's normal is fitted by a quadratic, over vertices that face
    the same way as the contact. The weight of a vertex falls to zero towards the radius.

    Args:
        rest: Resting positions of all vertices, shape (n, 3) [m].
        normals: Resting normals of all vertices, shape (n, 3).
        vertices: Vertices whose displacement is known, shape (k,).
        displacement: Displacement of these vertices, shape (k, 3) [m].
        frame: Foot, contact point and normal of the contact, shape (3, 3).
        radius: Radius of the fit [m].
        matrix: Scratch memory for the normal equations, shape (6, 8): column 6 is their right side,
            column 7 holds the terms of one vertex.

    Returns:
        The curvature [1/m]; zero with fewer than six vertices.
    """
    nx, ny, nz = frame[_NORMAL, 0], frame[_NORMAL, 1], frame[_NORMAL, 2]
    # Two tangents, without a step where the normal turns (Duff et al. 2017).
    sign = 1.0 if nz >= 0.0 else -1.0
    a = -1.0 / (sign + nz)
    b = nx * ny * a
    ux, uy, uz = 1.0 + sign * nx * nx * a, sign * b, -sign * nx
    vx, vy, vz = b, sign + ny * ny * a, -ny
    used = 0
    for i in range(_UNKNOWNS):
        for j in range(_UNKNOWNS + 1):
            matrix[i, j] = 0.0
    for k in range(vertices.shape[0]):
        vertex = vertices[k]
        facing = normals[vertex, 0] * nx + normals[vertex, 1] * ny + normals[vertex, 2] * nz
        x = (rest[vertex, 0] - frame[_POINT, 0]) / radius
        y = (rest[vertex, 1] - frame[_POINT, 1]) / radius
        z = (rest[vertex, 2] - frame[_POINT, 2]) / radius
        weight = 1.0 - x * x - y * y - z * z
        if weight <= 0.0 or facing <= 0.0:
            continue
        used += 1
        height = displacement[k, 0] * nx + displacement[k, 1] * ny + displacement[k, 2] * nz
        s, t = x * ux + y * uy + z * uz, x * vx + y * vy + z * vz
        add_height(matrix, s, t, height, facing * weight * weight)
    if used < _UNKNOWNS:
        return 0.0
    trace = 0.0
    for i in range(_UNKNOWNS):
        trace += matrix[i, i]
    # Points on a line leave a derivative undetermined; the Tikhonov term then makes it zero.
    for i in range(_UNKNOWNS):
        matrix[i, i] += _TIKHONOV * max(1e-9, trace)
    solve(matrix)
    ss, st, tt = matrix[0, _UNKNOWNS], matrix[1, _UNKNOWNS], matrix[2, _UNKNOWNS]
    half = 0.5 * (ss - tt)
    return float(math.sqrt(half * half + st * st) - 0.5 * (ss + tt)) / (radius * radius)


def add_height(matrix: Floats, s: float, t: float, height: float, weight: float) -> None:
    """Add one vertex to the upper triangle and the right side of the normal equations.

    Args:
        matrix: Normal equations, as in `fit_bulge`.
        s, t: Tangential coordinates of the vertex over the radius of the fit.
        height: Displacement of the vertex along the contact's normal [m].
        weight: Weight of the vertex in the fit.
    """
    row = _UNKNOWNS + 1  # column of `matrix` that holds the terms of the vertex
    matrix[0, row] = 0.5 * s * s
    matrix[1, row] = s * t
    matrix[2, row] = 0.5 * t * t
    matrix[3, row] = s
    matrix[4, row] = t
    matrix[5, row] = 1.0
    for i in range(_UNKNOWNS):
        fraction = weight * matrix[i, row]
        for j in range(i, _UNKNOWNS):
            matrix[i, j] += fraction * matrix[j, row]
        matrix[i, _UNKNOWNS] += fraction * height


def solve(matrix: Floats) -> None:
    """Solve the normal equations of `fit_bulge`; the solution replaces column 6 of `matrix`."""
    for i in range(_UNKNOWNS):
        for row in range(i + 1, _UNKNOWNS):
            factor = matrix[i, row] / matrix[i, i]
            for j in range(row, _UNKNOWNS):
                matrix[row, j] -= factor * matrix[i, j]
            matrix[row, _UNKNOWNS] -= factor * matrix[i, _UNKNOWNS]
    for i in range(_UNKNOWNS - 1, -1, -1):
        for j in range(i + 1, _UNKNOWNS):
            matrix[i, _UNKNOWNS] -= matrix[i, j] * matrix[j, _UNKNOWNS]
        matrix[i, _UNKNOWNS] /= matrix[i, i]
