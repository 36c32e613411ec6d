"""Makes a sphere of nearly equal triangles.

Tests check that the sphere equals that of trimesh, which is not used here: importing trimesh would
take a quarter of the start-up time of a server.
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
    """Make a sphere: a subdivided icosahedron with its vertices on the sphere.

    Args:
        subdivisions: Number of subdivisions, each of which quadruples the number of faces.
        radius: Radius of the sphere [m].

    Returns:
        Vertices (n, 3) [m] and faces (m, 3); n is 42, 162, 642, 2562 for 1 to 4 subdivisions.
    """
    x, faces = radius * _VERTICES, _FACES.astype(np.int64)
    for _ in range(subdivisions):
        x, faces = _subdivided(x, faces)
        x *= radius / np.linalg.norm(x, axis=1, keepdims=True)
    return x, faces


def _subdivided(x: Floats, faces: Ints) -> tuple[Floats, Ints]:
    """Return the mesh after each triangle was cut into four at the middles of its edges."""
    edges = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    _, first, edge_of = np.unique(
        len(x) * edges[:, 1] + edges[:, 0], return_index=True, return_inverse=True
    )
    a, b, c = faces.T
    ab, bc, ca = len(x) + edge_of.reshape(-1, 3).T
    finer = np.column_stack([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca]).reshape(-1, 3)
    return np.concatenate([x, x[edges[first]].mean(axis=1)]), finer
