"""A sphere of nearly equal triangles, and the rigid motions of points.

Tests check that the sphere equals that of trimesh, which is not used here: importing trimesh would
take a quarter of the start-up time of a server.

Rigid motions store no elastic energy.
"""

from __future__ import annotations

import numpy as np

from cohaptic_server.numeric import Floats, Ints

_A, _B = 0.5257311121191336, 0.85065080835204  # coordinates of an icosahedron in the unit sphere
_VERTICES = np.array(
    [
        [-_A, _B, 0.0], [_A, _B, 0.0], [-_A, -_B, 0.0], [_A, -_B, 0.0],
        [0.0, -_A, _B], [0.0, _A, _B], [0.0, -_A, -_B], [0.0, _A, -_B],
        [_B, 0.0, -_A], [_B, 0.0, _A], [-_B, 0.0, -_A], [-_B, 0.0, _A],
    ]
)  # fmt: skip
_FACES = np.array(
    [
        [0, 11, 5], [0, 5, 1], [0, 1, 7], [0, 7, 10], [0, 10, 11],
        [1, 5, 9], [5, 11, 4], [11, 10, 2], [10, 7, 6], [7, 1, 8],
        [3, 9, 4], [3, 4, 2], [3, 2, 6], [3, 6, 8], [3, 8, 9],
        [4, 9, 5], [2, 4, 11], [6, 2, 10], [8, 6, 7], [9, 8, 1],
    ]
)  # fmt: skip


def icosphere(subdivisions: int, radius: float) -> tuple[Floats, Ints]:
    """Make a subdivided icosahedron on a sphere; each subdivision quadruples the faces.

    Returns:
        Vertices (n, 3) [m] and faces (m, 3); n is 42, 162, 642, 2562 for 1 to 4 subdivisions.
    """
    x, faces = radius * _VERTICES, _FACES.astype(np.int64)
    for _ in range(subdivisions):
        x, faces = _subdivided(x, faces)
        x *= radius / np.linalg.norm(x, axis=1, keepdims=True)
    return x, faces


def _subdivided(x: Floats, faces: Ints) -> tuple[Floats, Ints]:
    """Cut each triangle into four, with a new vertex in the middle of each edge."""
    edges = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    _, first, edge_of = np.unique(
        len(x) * edges[:, 1] + edges[:, 0], return_index=True, return_inverse=True
    )
    a, b, c = faces.T
    ab, bc, ca = len(x) + edge_of.reshape(-1, 3).T
    finer = np.column_stack([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca]).reshape(-1, 3)
    return np.concatenate([x, x[edges[first]].mean(axis=1)]), finer


def rigid_motions(x: Floats) -> Floats:
    """Displacements of points by three translations and by three rotations about the origin.

    Args:
        x: Positions of the points, shape (n, 3) [m].

    Returns:
        One motion per column, shape (3 n, 6): translations by 1 m, rotations by 1 rad to first
        order.
    """
    motions = np.zeros((len(x), 3, 6))
    motions[:, :, :3] = np.eye(3)
    for axis in range(3):
        motions[:, :, 3 + axis] = np.cross(np.eye(3)[axis], x)
    return motions.reshape(-1, 6)


def rigid_rank(x: Floats) -> int:
    """Number of the six rigid motions that fixing the points `x`, shape (n, 3) [m], excludes."""
    centred = x - x.mean(axis=0)
    size = float(np.abs(centred).max()) or 1.0
    return int(np.linalg.matrix_rank(rigid_motions(centred / size), tol=1e-6))
