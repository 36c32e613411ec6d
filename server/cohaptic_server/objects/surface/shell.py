"""Makes a closed shell of a given thickness from an open sheet."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp
import scipy.sparse.csgraph

from cohaptic_server.mesh.surface import face_area_vectors
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.objects.memory_limit import silenced

# Area of the holes over that of the surface above which the surface is a sheet and not a body with
# holes: a sphere with a cap of 60 degrees cut off has 0.25, half a sphere 0.5 and a flat sheet 1.
SHEET = 0.25


class Rims(NamedTuple):
    """The rims of an open surface.

    Args:
        edges: Edges with one triangle, in the triangle's sense of rotation, shape (k, 2).
        loop: Index of the loop that each edge belongs to, shape (k,).
        loops: Number of loops.
    """

    edges: Ints
    loop: Ints
    loops: int


def find_rims(faces: Ints) -> Rims:
    """Find the edges that have only one triangle, and the loops that they form."""
    directed = faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    low, high = directed.min(axis=1), directed.max(axis=1)
    _, first, counts = np.unique(
        low * (int(faces.max()) + 1) + high, return_index=True, return_counts=True
    )
    edges = np.asarray(directed[np.sort(first[counts == 1])], dtype=np.int64)
    used, renamed = np.unique(edges, return_inverse=True)
    a, b = renamed.reshape(-1, 2).T
    graph = sp.coo_array((np.ones(len(a), dtype=np.int8), (a, b)), shape=(len(used), len(used)))
    count, label = scipy.sparse.csgraph.connected_components(sp.csr_array(graph), directed=False)
    return Rims(edges, np.asarray(label[a], dtype=np.int64), int(count))


def openness(x: Floats, faces: Ints) -> float:
    """Area of all holes over the area of the surface; 0 for a closed surface.

    The area of a hole is the length of the vector area of its rim, which is exact for a flat hole.
    """
    rims = find_rims(faces)
    if not rims.loops:
        return 0.0
    a, b = (x[rims.edges[:, k]] for k in (0, 1))
    cones = 0.5 * np.cross(a - x.mean(axis=0), b - x.mean(axis=0))
    vectors = np.zeros((rims.loops, 3))
    np.add.at(vectors, rims.loop, cones)
    whole = np.linalg.norm(face_area_vectors(x, faces), axis=1).sum()
    return float(np.linalg.norm(vectors, axis=1).sum() / max(float(whole), 1e-300))


def thicken(x: Floats, faces: Ints, thickness: float) -> tuple[Floats, Ints]:
    """Make a closed shell with the sheet in its middle.

    Where the radius of a bend is less than half of the thickness, the shell passes through itself,
    which fTetWild untangles.

    Args:
        x: Vertices of the sheet, shape (n, 3).
        faces: Triangles of the sheet; neighbours have one sense of rotation, shape (m, 3).
        thickness: Thickness of the shell, in the unit of the vertices.

    Returns:
        Vertices, shape (2 n, 3), and triangles that face outwards, shape (2 m + 2 k, 3).
    """
    normals = np.zeros_like(x)
    areas = face_area_vectors(x, faces)
    for corner in range(3):
        np.add.at(normals, faces[:, corner], areas)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    n, half = len(x), 0.5 * thickness * normals
    a, b = find_rims(faces).edges.T
    walls = [np.stack([b, a, a + n], axis=1), np.stack([b, a + n, b + n], axis=1)]
    both = np.concatenate([faces, faces[:, ::-1] + n, *walls])
    return np.concatenate([x + half, x - half]), np.asarray(both, dtype=np.int64)


def in_one_sense(x: Floats, faces: Ints) -> Ints:
    """Reverse triangles where needed, so that neighbours have one sense of rotation, (m, 3)."""
    import trimesh  # imported here, since a prepared object starts without trimesh

    with silenced("trimesh"):
        mesh: Any = trimesh.Trimesh(x, faces, process=False)
        trimesh.repair.fix_winding(mesh)  # type: ignore[no-untyped-call]  # pyright: ignore[reportUnknownMemberType]
    return np.asarray(mesh.faces, dtype=np.int64)
