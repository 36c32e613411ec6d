"""Nested dissection, an order of elimination that keeps the Cholesky factor of a solid sparse.

A thin set of nodes cuts the mesh in two halves that do not touch; each half is cut again, down to
leaves. Eliminating the halves before their separator fills O(n^(4/3)) entries in three dimensions
(George 1973; Lipton, Rose, Tarjan 1979), a fraction of the entries that a minimum degree order
fills. Planes cut the mesh: several planes near the median, at right angles to the part's principal
axes, are tried, and the one with the smallest separator, weighted by the balance of the halves, is
taken.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import scipy.sparse as sp
from scipy.sparse import csgraph

from cohaptic_server.numeric import Floats, Ints

LEAF = 96  # nodes; smaller leaves mean more and smaller fronts, without gain for a linear solid
_TRIED = 5000  # nodes; larger parts get one cut, since several would take seconds
_SHARES = (0.45, 0.5, 0.55)  # shares of the nodes on one side of a cut

AnyInts = npt.NDArray[np.int32] | Ints  # the indices of a sparse matrix are 32-bit
Sides = npt.NDArray[np.int8]  # scratch, zero between calls: the half in which each node is


@dataclass(frozen=True, eq=False)
class Part:
    """A separator or a leaf, as one vertex of the tree of separators.

    Args:
        own: Nodes of the mesh that this part eliminates, shape (k,).
        children: Indices of the parts at the top of the two halves; empty for a leaf.
    """

    own: Ints
    children: tuple[int, ...]


class Cut(NamedTuple):
    """Two halves without an edge between them, and the nodes that separate them."""

    first: Ints
    second: Ints
    between: Ints


def dissect(points: Floats, graph: sp.csr_array, leaf: int = LEAF) -> list[Part]:
    """Cut a graph into separators and leaves, listed with each child before its parent.

    Args:
        points: Position of each node, shape (n, 3) [m].
        graph: Adjacency of nodes that share an element, symmetric, shape (n, n).
        leaf: Largest number of nodes of a part that is not cut any further.

    Returns:
        Parts in an order in which they can be eliminated; every node is in the `own` of one part.
    """
    parts: list[Part] = []
    side = np.zeros(len(points), dtype=np.int8)

    def cut(nodes: Ints) -> int:
        if len(nodes) > leaf:
            first, second, between = _halves(points, graph, nodes, side)
            if len(first) and len(second):
                children = (cut(first), cut(second))
                parts.append(Part(between, children))
                return len(parts) - 1
        parts.append(Part(nodes, ()))
        return len(parts) - 1

    cut(np.arange(len(points), dtype=np.int64))
    return parts


def _halves(points: Floats, graph: sp.csr_array, nodes: Ints, side: Sides) -> Cut:
    """Return the best of a few cuts of `nodes` into two halves and a separator."""
    x = points[nodes] - points[nodes].mean(axis=0)
    axes = np.linalg.eigh(x.T @ x)[1][:, ::-1]
    best, least = Cut(nodes, nodes[:0], nodes[:0]), math.inf
    few = len(nodes) <= _TRIED
    for along in axes.T if few else axes.T[:1]:
        # By rank, not by position: in a graded mesh each half then has half of the nodes.
        order = nodes[np.argsort(x @ along, kind="stable")]
        for share in _SHARES if few else (0.5,):
            count = round(share * len(nodes))
            cut = _separate(graph, order[:count], order[count:], side)
            larger = max(len(cut.first), len(cut.second)) / len(nodes)
            cost = len(cut.between) * (0.5 + larger)
            if len(cut.first) and len(cut.second) and cost < least:
                best, least = cut, cost
    return best


def _separate(graph: sp.csr_array, first: Ints, second: Ints, side: Sides) -> Cut:
    """Return the halves without the fewest nodes that touch every edge between the two.

    The edges between the halves are a bipartite graph, whose smallest vertex cover follows from a
    maximum matching (König 1931).
    """
    side[second] = 1
    starts, counts = graph.indptr[first], np.diff(graph.indptr)[first]
    there = graph.indices[_ranges(starts, counts)]
    across = side[there] == 1
    here = np.repeat(first, counts)[across]
    side[second] = 0
    left, row = np.unique(here, return_inverse=True)
    right, column = np.unique(there[across], return_inverse=True)
    edges = sp.csr_matrix(
        (np.ones(len(row), dtype=np.int8), (row, column)), shape=(len(left), len(right))
    )
    matched = np.asarray(csgraph.maximum_bipartite_matching(edges, perm_type="column"))
    partner = np.full(len(right), -1, dtype=np.int64)
    partner[matched[matched >= 0]] = np.flatnonzero(matched >= 0)
    # Nodes reached from unmatched ones by paths that alternate between unmatched and matched edges.
    reached, beyond = matched < 0, np.zeros(len(right), dtype=np.bool_)
    rows = np.flatnonzero(reached)
    while len(rows):
        columns = np.unique(edges.indices[_ranges(edges.indptr[rows], np.diff(edges.indptr)[rows])])
        columns = columns[~beyond[columns]]
        beyond[columns] = True
        rows = partner[columns]
        rows = rows[(rows >= 0) & ~reached[rows]]
        reached[rows] = True
    between = np.concatenate([left[~reached], right[beyond]]).astype(np.int64)
    return Cut(
        np.setdiff1d(first, between, assume_unique=True),
        np.setdiff1d(second, between, assume_unique=True),
        np.sort(between),
    )


def _ranges(starts: AnyInts, counts: AnyInts) -> Ints:
    """Return the integers of several ranges, one range after the other."""
    return np.asarray(
        np.arange(int(counts.sum())) + np.repeat(starts - np.cumsum(counts) + counts, counts)
    )
