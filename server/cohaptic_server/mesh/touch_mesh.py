"""The surface as a finger needs it: of a fine mesh, as few vertices as its contact can tell apart.

A patch holds a bounded number of vertices, and a mesh may be as fine as its maker likes. What a
contact feels is an average over its pressure, so that vertices much closer together than its radius
say the same thing twice, and end before a sliding hand does. A fine mesh is therefore thinned for
touching: some of its vertices, spread evenly, and between them the triangles of their regions
(the dual of their Voronoi diagram on the surface). What is seen stays as it is.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from cohaptic.protocol.neighbourhood import MAX_VERTICES
from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.numeric import Floats, Ints

APART = 0.7  # contact radii: the least distance between two vertices of a thinned mesh
_WORTH = 0.75  # of that distance: a mesh with vertices further apart is taken as it is


@dataclass(frozen=True, eq=False)
class TouchMesh:
    """Some vertices of a surface and the triangles between them.

    Args:
        vertices: As indices into the whole surface, rising, shape (t,).
        faces: As indices into `vertices`, counter-clockwise seen from outside, shape (m, 3).
        points: Positions of the vertices at rest, shape (t, 3) [m].
        normals: Of the whole surface there, shape (t, 3).
        spacing: Mean distance between neighbours, as if they were spread evenly [m].

    Attributes:
        tree: Of `points`.
    """

    vertices: Ints
    faces: Ints
    points: Floats
    normals: Floats
    spacing: float
    tree: cKDTree = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "tree", cKDTree(self.points))
        for array in (self.vertices, self.faces, self.points, self.normals):
            array.setflags(write=False)

    def near(self, point: Floats, radius: float) -> Ints:
        """Its vertices within `radius` of a point at rest, by its own numbers, rising."""
        return np.array(self.tree.query_ball_point(point, radius, return_sorted=True), np.int64)

    def among(self, vertices: Ints) -> Ints:
        """Those of some vertices of the whole surface that are its own, in their order."""
        place = self.vertices.searchsorted(vertices)
        return np.asarray(vertices[self.vertices.take(place, mode="clip") == vertices])


def thinned(mesh: SurfaceMesh, apart: float) -> TouchMesh:
    """Vertices that are no closer together than a distance, where a mesh has too many.

    Two sides of a thin part are no neighbours, however close: their normals part them.

    Args:
        mesh: Resting surface.
        apart: Least distance between two vertices [m].
    """
    # Of a body hardly larger than its contacts there is to be left as much as a frame holds.
    apart = min(apart, _WORTH * mesh.spacing(MAX_VERTICES))
    if mesh.spacing() >= _WORTH * apart:
        return _touch_mesh(mesh, np.arange(len(mesh.vertices)), mesh.faces)
    chosen = _spread(mesh, apart)
    faces = _dual(mesh, chosen)
    used = np.unique(faces)
    return _touch_mesh(mesh, chosen[used], np.searchsorted(used, faces))


def _touch_mesh(mesh: SurfaceMesh, vertices: Ints, faces: Ints) -> TouchMesh:
    places, normals = mesh.vertices[vertices], mesh.normals[vertices]
    return TouchMesh(vertices, faces.copy(), places, normals, mesh.spacing(len(vertices)))


def _spread(mesh: SurfaceMesh, apart: float) -> Ints:
    """Vertices none of which is near another, and one of which is near any, rising."""
    n = len(mesh.vertices)
    pairs = np.asarray(mesh.tree.query_pairs(apart, output_type="ndarray"), dtype=np.int64)
    same_side = (mesh.normals[pairs[:, 0]] * mesh.normals[pairs[:, 1]]).sum(axis=1) > 0.0
    pairs = pairs[same_side]
    both = np.concatenate([pairs, pairs[:, ::-1]])
    near = csr_array((np.ones(len(both), dtype=np.bool_), (both[:, 0], both[:, 1])), shape=(n, n))
    free = np.ones(n, dtype=np.bool_)
    chosen: list[int] = []
    # From one end to the other, ring by ring: vertices chosen in a row lie as close as they may.
    for k in np.argsort(mesh.vertices[:, 2], kind="stable").tolist():
        if free[k]:
            chosen.append(k)
            free[near.indices[near.indptr[k] : near.indptr[k + 1]]] = False
    return np.sort(np.array(chosen, dtype=np.int64))


def _dual(mesh: SurfaceMesh, chosen: Ints) -> Ints:
    """Triangles between the chosen: where the regions of three of them meet, shape (m, 3)."""
    n = len(mesh.vertices)
    edges = np.concatenate([mesh.faces[:, [0, 1]], mesh.faces[:, [1, 2]], mesh.faces[:, [2, 0]]])
    edges = np.unique(np.sort(edges, axis=1), axis=0)
    lengths = np.linalg.norm(mesh.vertices[edges[:, 0]] - mesh.vertices[edges[:, 1]], axis=1)
    graph = csr_array((np.maximum(lengths, 1e-12), (edges[:, 0], edges[:, 1])), shape=(n, n))
    _, _, source = dijkstra(
        graph, directed=False, indices=chosen, min_only=True, return_predecessors=True
    )
    place = np.full(n + 1, -1, dtype=np.int64)
    place[chosen] = np.arange(len(chosen))
    regions = place[source[mesh.faces]]  # -9999 where nothing leads: never, with one on each piece
    a, b, c = regions.T
    met = regions[(a != b) & (b != c) & (c != a) & (regions.min(axis=1) >= 0)]
    _, first = np.unique(np.sort(met, axis=1), axis=0, return_index=True)
    return np.asarray(met[np.sort(first)])
