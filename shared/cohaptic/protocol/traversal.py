"""The order in which a surface is sent, and the vertices that predict each vertex.

Both sides derive the same order from the resting mesh: breadth first from vertex 0, neighbours by
number. If a face p q r was sent before, a vertex beyond its edge p q is predicted as p + q - r, the
fourth corner of a parallelogram; on a smooth surface the residual is small (Touma and Gotsman 1998,
Triangle mesh compression).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy.sparse as sp
from scipy.sparse.csgraph import breadth_first_order

Ints = npt.NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Traversal:
    """Order and predictors of the vertices of one resting mesh.

    Args:
        order: Vertices in the order of sending, shape (n,).
        p, q, r: Vertices that predict `order[k]` as p + q - r, shape (n,); the number n stands for
            a vertex at zero.
    """

    order: Ints
    p: Ints
    q: Ints
    r: Ints

    @classmethod
    def of(cls, n: int, faces: npt.ArrayLike) -> Traversal:
        """The traversal of a mesh.

        Args:
            n: Number of vertices.
            faces: Corners of the faces, shape (m, 3).
        """
        corners = np.asarray(faces, dtype=np.int64).reshape(-1, 3)
        graph = _graph(n, corners)
        order = _breadth_first(graph)
        place = np.empty(n, dtype=np.int64)
        place[order] = np.arange(n)
        predicted = np.full((n, 3), n)  # by vertex
        _by_neighbour(predicted, graph, order, place)
        _by_parallelogram(predicted, corners, place)
        p, q, r = predicted[order].T
        return cls(order, p, q, r)

    @property
    def vertices(self) -> int:
        """Number of vertices."""
        return len(self.order)


def _graph(n: int, corners: Ints) -> sp.csr_array:
    """Sparse matrix of the vertices that share an edge; neighbours are sorted by number."""
    a, b = corners.ravel(), corners[:, [1, 2, 0]].ravel()
    rows, columns = np.concatenate([a, b]), np.concatenate([b, a])
    ones = np.ones(len(rows), dtype=np.int8)
    graph = sp.csr_array(sp.coo_array((ones, (rows, columns)), shape=(n, n)))
    graph.sort_indices()
    return graph


def _breadth_first(graph: sp.csr_array) -> Ints:
    """All vertices, breadth first; each connected part begins with its lowest-numbered vertex."""
    left = np.ones(graph.shape[0], dtype=np.bool_)
    parts: list[Ints] = []
    while left.any():
        start = int(left.argmax())
        part = breadth_first_order(graph, start, return_predecessors=False)
        parts.append(np.asarray(part, dtype=np.int64))
        left[part] = False
    return np.concatenate(parts)


def _by_neighbour(predicted: Ints, graph: sp.csr_array, order: Ints, place: Ints) -> None:
    """Predict each vertex by the neighbour that was sent first: p = q = r is that neighbour."""
    rows = np.repeat(np.arange(len(order)), np.diff(graph.indptr))
    first = np.full(len(order), len(order))
    np.minimum.at(first, rows, place[graph.indices])
    came = first < place
    predicted[came] = order[first[came]][:, None]


def _by_parallelogram(predicted: Ints, corners: Ints, place: Ints) -> None:
    """Predict each vertex by a parallelogram over an edge p q that exactly two faces share.

    If several edges are possible, the edge whose far corner r was sent first is used.
    """
    far = corners.ravel()
    ends = np.sort(np.stack([corners[:, [1, 2, 0]], corners[:, [2, 0, 1]]], axis=2).reshape(-1, 2))
    _, edge, count = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
    by_edge = np.argsort(edge.ravel(), kind="stable")
    one, two = by_edge[count[edge.ravel()[by_edge]] == 2].reshape(-1, 2).T
    v = far[np.concatenate([one, two])]
    r = far[np.concatenate([two, one])]
    sides = ends[np.concatenate([one, one])]
    later = (place[sides[:, 0]] > place[sides[:, 1]]).astype(np.int64)
    rows = np.arange(len(sides))
    p, q = sides[rows, later], sides[rows, 1 - later]
    keep = np.flatnonzero(np.maximum(place[q], place[r]) < place[v])
    # Sorted so that the best prediction of each vertex is written last.
    best = keep[np.lexsort((place[q[keep]], place[p[keep]], place[r[keep]]))][::-1]
    for column, corner in enumerate((p, q, r)):
        predicted[v[best], column] = corner[best]
