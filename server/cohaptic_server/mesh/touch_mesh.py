"""The touch mesh: a fine surface, thinned to about as many vertices as a contact can resolve.

A patch holds a bounded number of vertices, while a mesh may be arbitrarily fine. A contact averages
over its pressure, so vertices much closer together than the contact radius carry the same
information, and a patch of such vertices would be so small that a sliding hand soon leaves it. A
fine mesh is therefore thinned for touch, to evenly spread vertices and the dual triangles of their
Voronoi regions on the surface. The mesh that pages display is not thinned.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from cohaptic.protocol.neighbourhood import MAX_VERTICES
from cohaptic_server.mesh.search.window_search import WindowSearch
from cohaptic_server.mesh.surface import NearTree, SurfaceMesh
from cohaptic_server.numeric import Floats, Ints

MAX_PATH = 0.3  # m; longest path ahead of a contact
APART = 0.7  # least distance between two vertices of a thinned mesh, in contact radii
_COARSE = 0.75  # share of that distance; a mesh with a larger vertex spacing is not thinned


@dataclass(frozen=True, eq=False)
class TouchMesh:
    """A subset of the vertices of a surface, and triangles between these vertices.

    Args:
        vertices: Indices of these vertices in the whole surface, in rising order, shape (t,).
        faces: Indices into `vertices`, counter-clockwise seen from outside, shape (m, 3).
        points: Positions of the vertices at rest, shape (t, 3) [m].
        normals: Normals of the whole surface at these vertices, shape (t, 3).
        spacing: Mean distance between neighbours of evenly spread vertices [m].

    Attributes:
        search: Search for the vertices within a radius of a given point.
        window: Search for the vertices near the path of a sliding contact.
        found: Array to which `window` writes vertices, as indices into `points`, shape (t,).
        path: Array to which `window` writes the points of a path, shape (w, 3) [m].
    """

    vertices: Ints
    faces: Ints
    points: Floats
    normals: Floats
    spacing: float
    search: NearTree = field(init=False)
    window: WindowSearch = field(init=False)
    found: Ints = field(init=False)
    path: Floats = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "search", NearTree(self.points))
        object.__setattr__(self, "found", np.zeros(len(self.points), dtype=np.int64))
        object.__setattr__(self, "path", np.zeros((math.ceil(MAX_PATH / self.spacing) + 2, 3)))
        window = WindowSearch(
            self.points,
            self.normals,
            _beside(self.faces, len(self.points)),
            self.search.tree,
            self.found,
            self.path,
        )
        object.__setattr__(self, "window", window)
        for array in (self.vertices, self.faces, self.points, self.normals):
            array.setflags(write=False)


def _beside(faces: Ints, count: int) -> Ints:
    """Return the vertices that share an edge with each vertex, shape (count, valence).

    Short rows are filled with the vertex itself.
    """
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    edges = np.unique(np.concatenate([edges, edges[:, ::-1]]), axis=0)  # by their first vertex
    row = edges[:, 0]
    starts = np.searchsorted(row, np.arange(count))
    column = np.arange(len(row)) - starts[row]
    table = np.repeat(np.arange(count), int(column.max(initial=0)) + 1).reshape(count, -1)
    table[row, column] = edges[:, 1]
    return table


def thinned(mesh: SurfaceMesh, apart: float) -> TouchMesh:
    """Thin a surface to a touch mesh, whose vertices keep a least distance from each other.

    The touch mesh of a coarse surface has all of its vertices. Vertices on the two sides of a thin
    part are never neighbours, however close: their normals distinguish them.

    Args:
        mesh: Resting surface.
        apart: Least distance between two vertices [m].
    """
    # On small bodies keep at least `MAX_VERTICES` vertices, as many as a frame holds.
    apart = min(apart, _COARSE * mesh.spacing(MAX_VERTICES))
    if mesh.spacing() >= _COARSE * apart:
        return _touch_mesh(mesh, np.arange(len(mesh.vertices)), mesh.faces)
    chosen = _spread(mesh, apart)
    faces = _dual(mesh, chosen)
    used = np.unique(faces)
    return _touch_mesh(mesh, chosen[used], np.searchsorted(used, faces))


def _touch_mesh(mesh: SurfaceMesh, vertices: Ints, faces: Ints) -> TouchMesh:
    points, normals = mesh.vertices[vertices], mesh.normals[vertices]
    return TouchMesh(vertices, faces.copy(), points, normals, mesh.spacing(len(vertices)))


def _spread(mesh: SurfaceMesh, apart: float) -> Ints:
    """Choose vertices at least `apart` [m] from each other until no other fits, in rising order.

    Vertices on opposite sides of a thin part may be closer.
    """
    n = len(mesh.vertices)
    pairs = np.asarray(mesh.tree.query_pairs(apart, output_type="ndarray"), dtype=np.int64)
    same_side = (mesh.normals[pairs[:, 0]] * mesh.normals[pairs[:, 1]]).sum(axis=1) > 0.0
    pairs = pairs[same_side]
    both = np.concatenate([pairs, pairs[:, ::-1]])
    near = csr_array((np.ones(len(both), dtype=np.bool_), (both[:, 0], both[:, 1])), shape=(n, n))
    free = np.ones(n, dtype=np.bool_)
    chosen: list[int] = []
    # In order of height, so that successive choices lie close to the least distance.
    for k in np.argsort(mesh.vertices[:, 2], kind="stable").tolist():
        if free[k]:
            chosen.append(k)
            free[near.indices[near.indptr[k] : near.indptr[k + 1]]] = False
    return np.sort(np.array(chosen, dtype=np.int64))


def _dual(mesh: SurfaceMesh, chosen: Ints) -> Ints:
    """Return the triangles of chosen vertices whose three Voronoi regions meet in a face, (m, 3).

    The triangles are indices into `chosen`.
    """
    n = len(mesh.vertices)
    edges = np.concatenate([mesh.faces[:, [0, 1]], mesh.faces[:, [1, 2]], mesh.faces[:, [2, 0]]])
    edges = np.unique(np.sort(edges, axis=1), axis=0)
    lengths = np.linalg.norm(mesh.vertices[edges[:, 0]] - mesh.vertices[edges[:, 1]], axis=1)
    graph = csr_array((np.maximum(lengths, 1e-12), (edges[:, 0], edges[:, 1])), shape=(n, n))
    _, _, source = dijkstra(
        graph, directed=False, indices=chosen, min_only=True, return_predecessors=True
    )
    index = np.full(n + 1, -1, dtype=np.int64)
    index[chosen] = np.arange(len(chosen))
    regions = index[source[mesh.faces]]  # every piece has a chosen vertex, so all are reached
    a, b, c = regions.T
    met = regions[(a != b) & (b != c) & (c != a) & (regions.min(axis=1) >= 0)]
    _, first = np.unique(np.sort(met, axis=1), axis=0, return_index=True)
    return np.asarray(met[np.sort(first)])
