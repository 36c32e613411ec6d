"""A least-squares sphere through displaced vertices: the inner loop of `mesh/curvature.py`."""

from __future__ import annotations

from cohaptic_server.numeric import Floats, Ints

_UNKNOWNS = 5  # curvature, height, and tilt as a vector of three components
_TIKHONOV = 1e-10  # relative to the mean of the normal matrix's diagonal
MIN_POINTS = 6  # a sphere with height and tilt in two directions has four unknowns


def fit_spheres(
    rest: Floats,
    starts: Ints,
    vertices: Ints,
    displacement: Floats,
    rows: Ints,
    points: Floats,
    normals: Floats,
    radius: float,
    matrix: Floats,
    curvature: Floats,
) -> None:
    """Fit a sphere to the displaced vertices round each contact, and write its curvature.

    Args:
        rest: Resting positions of all vertices, shape (v, 3) [m].
        starts: Offsets of the n contacts' parts of `vertices` (row 0) and of `rows` (row 1), shape
            (2 or more, n + 1): part i begins at column i and ends before column i + 1.
        vertices: Vertices whose displacement is known, contact after contact, shape (k,).
        displacement: Displacement of these vertices, shape (k, 3) [m].
        rows: Vertices to which the spheres are fitted, as indices into the contact's part of
            `vertices`, shape (r,).
        points: Points through which the spheres go, roughly, shape (n, 3) [m].
        normals: Outward unit normals at these points, shape (n, 3).
        radius: Radius of the fit [m].
        matrix: Scratch memory for the normal equations, shape (5, 6).
        curvature: Set to the curvatures, without a bound; 0 with fewer than six vertices; shape
            (n,) [1/m].
    """
    for i in range(curvature.shape[0]):
        a, b, c, d = starts[0, i], starts[0, i + 1], starts[1, i], starts[1, i + 1]
        curvature[i] = 0.0
        if d - c >= MIN_POINTS:
            curvature[i] = fit_sphere(
                rest, vertices[a:b], displacement[a:b], rows[c:d], points[i], normals[i], radius,
                matrix,
            )  # fmt: skip


# One pass over the vertices with a point and a normal, which are six numbers.
def fit_sphere(
    rest: Floats,
    vertices: Ints,
    displacement: Floats,
    rows: Ints,
    point: Floats,
    normal: Floats,
    radius: float,
    matrix: Floats,
) -> float:
    """Fit a sphere to displaced vertices round one point, and return its curvature [1/m].

    Args:
        rest: Resting positions of all vertices, shape (n, 3) [m].
        vertices: Vertices whose displacement is known, shape (k,).
        displacement: Displacement of these vertices, shape (k, 3) [m].
        rows: Vertices to which the sphere is fitted, as indices into `vertices`, shape (r,).
        point: Point through which the sphere goes, roughly, shape (3,) [m].
        normal: Outward unit normal at this point, shape (3,).
        radius: Radius of the fit [m].
        matrix: Scratch memory for the normal equations, shape (5, 6).

    Returns:
        The curvature, without a bound; zero with fewer than six vertices.
    """
    nx, ny, nz = normal[0], normal[1], normal[2]
    used, per = 0, 1.0 / radius
    for i in range(_UNKNOWNS):
        for j in range(_UNKNOWNS + 1):
            matrix[i, j] = 0.0
    for r in range(rows.shape[0]):
        k = rows[r]
        v = vertices[k]
        x = rest[v, 0] + displacement[k, 0] - point[0]
        y = rest[v, 1] + displacement[k, 1] - point[1]
        z = rest[v, 2] + displacement[k, 2] - point[2]
        height = x * nx + y * ny + z * nz
        # The distance counts the height: points on the far side of a thin body are close in the
        # tangent plane.
        square = (x * x + y * y + z * z) * (per * per)
        weight = 1.0 - square
        if weight <= 0.0:
            continue
        used += 1
        add_point(
            matrix,
            square,
            (x - height * nx) * per,
            (y - height * ny) * per,
            (z - height * nz) * per,
            height,
            weight * weight,
        )
    if used < MIN_POINTS:
        return 0.0
    trace = 0.0
    for i in range(_UNKNOWNS):
        trace += matrix[i, i]
    # The tilt along the normal is undetermined, and so are more unknowns if the points lie on a
    # line; the Tikhonov term sets undetermined unknowns to zero.
    for i in range(_UNKNOWNS):
        matrix[i, i] += _TIKHONOV * max(1e-9, trace)
    return -2.0 * first_unknown(matrix) / (radius * radius)


def add_point(
    matrix: Floats, square: float, x: float, y: float, z: float, height: float, weight: float
) -> None:
    """Add one vertex to the upper triangle and the right side of the normal equations.

    Args:
        matrix: Normal equations, shape (5, 6); the last column is their right side.
        square: Squared distance of the vertex from the point of the fit, over the squared radius.
        x, y, z: Tangential offset of the vertex from this point, over the radius.
        height: Height of the vertex over the tangent plane [m].
        weight: Weight of the vertex in the fit.
    """
    matrix[0, 0] += weight * square * square
    matrix[0, 1] += weight * square
    matrix[0, 2] += weight * square * x
    matrix[0, 3] += weight * square * y
    matrix[0, 4] += weight * square * z
    matrix[0, 5] += weight * square * height
    matrix[1, 1] += weight
    matrix[1, 2] += weight * x
    matrix[1, 3] += weight * y
    matrix[1, 4] += weight * z
    matrix[1, 5] += weight * height
    matrix[2, 2] += weight * x * x
    matrix[2, 3] += weight * x * y
    matrix[2, 4] += weight * x * z
    matrix[2, 5] += weight * x * height
    matrix[3, 3] += weight * y * y
    matrix[3, 4] += weight * y * z
    matrix[3, 5] += weight * y * height
    matrix[4, 4] += weight * z * z
    matrix[4, 5] += weight * z * height


def first_unknown(matrix: Floats) -> float:
    """Solve the normal equations of `fit_sphere` for their first unknown, and return it.

    The other unknowns are eliminated from the last one up.
    """
    for i in range(_UNKNOWNS - 1, 0, -1):
        for row in range(i):
            factor = matrix[row, i] / matrix[i, i]
            for j in range(row, i):
                matrix[row, j] -= factor * matrix[j, i]
            matrix[row, _UNKNOWNS] -= factor * matrix[i, _UNKNOWNS]
    return float(matrix[0, _UNKNOWNS] / matrix[0, 0])
