"""Symbolic analysis of a sparse Cholesky factor: everything that the pattern alone determines.

Nested dissection gives an order of elimination that keeps the Cholesky factor of a solid sparse. A
thin set of nodes, the separator, cuts the mesh in two halves without an edge between them; each
half is cut again, down to leaves. If the halves are eliminated before their separator, the factor
of n nodes in three dimensions has O(n^(4/3)) entries (George 1973; Lipton, Rose, Tarjan 1979), a
fraction of the entries after a minimum degree order. Planes cut the mesh: several planes near the
median, at right angles to the part's principal axes, are tried, and the one with the smallest
separator, weighted by the balance of the halves, is taken.

Each part of this tree becomes a dense front over the part's own nodes and their border: the nodes
of ancestors to which the own nodes are coupled. A matrix whose entries change and whose pattern
does not, such as the tangent of a nonlinear body, is analysed once and factored (`refactor.py`)
many times. Such a matrix is a list of 3x3 blocks, one for each pair of coupled nodes, column by
column in the order of elimination. The list has only the blocks on and below the diagonal.
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
_FRACTIONS = (0.45, 0.5, 0.55)  # shares of the nodes on one side of a cut

AnyInts = npt.NDArray[np.int32] | Ints  # the indices of a sparse matrix are 32-bit
Sides = npt.NDArray[np.int8]  # scratch, zero between calls: the half in which each node is


@dataclass(frozen=True, eq=False)
class Part:
    """A separator or a leaf, as one vertex of the tree of separators.

    Args:
        own: Nodes of the mesh that this part eliminates, shape (k,).
        children: Indices of the parts that separate the two halves in turn; empty for a leaf.
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
            first, second, between = _cut(points, graph, nodes, side)
            if len(first) and len(second):
                children = (cut(first), cut(second))
                parts.append(Part(between, children))
                return len(parts) - 1
        parts.append(Part(nodes, ()))
        return len(parts) - 1

    cut(np.arange(len(points), dtype=np.int64))
    return parts


def _cut(points: Floats, graph: sp.csr_array, nodes: Ints, side: Sides) -> Cut:
    """Return the best of a few cuts of `nodes` into two halves and a separator."""
    x = points[nodes] - points[nodes].mean(axis=0)
    axes = np.linalg.eigh(x.T @ x)[1][:, ::-1]
    best, least = Cut(nodes, nodes[:0], nodes[:0]), math.inf
    few = len(nodes) <= _TRIED
    for along in axes.T if few else axes.T[:1]:
        # By rank, not by position: in a graded mesh each half then has half of the nodes.
        order = nodes[np.argsort(x @ along, kind="stable")]
        for fraction in _FRACTIONS if few else (0.5,):
            count = round(fraction * len(nodes))
            cut = _separate(graph, order[:count], order[count:], side)
            larger = max(len(cut.first), len(cut.second)) / len(nodes)
            cost = len(cut.between) * (0.5 + larger)
            if len(cut.first) and len(cut.second) and cost < least:
                best, least = cut, cost
    return best


def _separate(graph: sp.csr_array, first: Ints, second: Ints, side: Sides) -> Cut:
    """Take the fewest nodes that touch every edge between two halves as their separator.

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
    """Return the integers of several ranges, each with its start and count, one after the other."""
    return np.asarray(
        np.arange(int(counts.sum())) + np.repeat(starts - np.cumsum(counts) + counts, counts)
    )


# Largest leaf, in nodes. A front of any size costs a dozen calls of LAPACK, each of some
# microseconds; below this size the calls cost more than the arithmetic that smaller leaves save.
_LEAF = 24


@dataclass(frozen=True, eq=False)
class Front:
    """The pattern of one front; nodes are numbered in the order of elimination.

    Args:
        first: First node that is eliminated in this front.
        last: Node after the last one that is eliminated in this front.
        border: Nodes of ancestors to which the front's nodes are coupled, rising, shape (k,).
        children: Indices of the fronts whose updates are added to this front.
        start: Index in the values of the factor at which the front's part begins.
        update: Index in the workspace of a factorisation at which the front's update begins.
    """

    first: int
    last: int
    border: Ints
    children: tuple[int, ...]
    start: int
    update: int

    @property
    def width(self) -> int:
        """Number of unknowns that are eliminated in this front."""
        return 3 * (self.last - self.first)

    @property
    def height(self) -> int:
        """Number of unknowns of the border."""
        return 3 * len(self.border)


@dataclass(frozen=True, eq=False)
class Analysis:
    """The analysis of a pattern: everything that a numerical factorisation needs in advance.

    Args:
        order: Nodes in the order of elimination, shape (n,).
        starts: Index of the first block of each block column, the diagonal block, shape (n + 1,).
        rows: Block row of each block, rising within a column, shape (e,).
        places: Row of each block within the front of the block's column, in nodes, shape (e,).
        fronts: Fronts, children before their parents; the last one is the root.
        table: Numbers of each front for the compiled loops, shape (f, 9): first, last, number of
            border nodes, start and update, as in `Front`; index of its first row in `where`; number
            of its border nodes that the parent eliminates; index of its first child in `children`,
            and index after its last child.
        where: For each border node of each front, the node's row in the parent, in nodes, and the
            index in the border at which the node's run of successive rows ends, shape (w, 2).
        children: Indices of the children of all fronts, front after front.
        borders: Border nodes of all fronts, each at the same index as in `where`, shape (w,).
        halves: (i, j): the fronts 0 to i - 1 and the fronts i to j - 1 are the two subtrees of the
            first separator and do not depend on each other; (0, 0) if there is no separator.
        values: Number of values of the factor.
        workspace: Largest number of values of the updates that exist at one time.
    """

    order: Ints
    starts: Ints
    rows: Ints
    places: Ints
    fronts: list[Front]
    table: Ints
    where: Ints
    children: Ints
    borders: Ints
    halves: tuple[int, int]
    values: int
    workspace: int

    @property
    def size(self) -> int:
        """Number of unknowns, 3 n."""
        return 3 * len(self.order)

    @property
    def dof(self) -> Ints:
        """Unknowns in the order of elimination, shape (3 n,)."""
        return dofs(self.order)

    def blocks_of(self, elements: Ints) -> Ints:
        """Find the block of each pair of nodes of each element, for assembly.

        Args:
            elements: Nodes of each element, negative if fixed, shape (m, k).

        Returns:
            Index of the block for each pair (a, b) with b <= a, row by row; -1 - index if the
            stored block is its transpose, that of (b, a); `len(rows)`, an index beyond all blocks,
            if a node is fixed. Shape (m, k (k + 1) / 2).
        """
        n = len(self.order)
        place = np.full(n + 1, -1, dtype=np.int64)
        place[self.order] = np.arange(n)
        a, b = np.tril_indices(elements.shape[1])
        first, second = place[elements[:, a]], place[elements[:, b]]
        row, column = np.maximum(first, second), np.minimum(first, second)
        keys = np.repeat(np.arange(n), np.diff(self.starts)) * n + self.rows
        index = np.searchsorted(keys, column * n + row)
        index = np.where(column < 0, len(self.rows), index)
        return np.asarray(np.where((first < second) & (column >= 0), -1 - index, index))


# One pass over the fronts fills tables that refer to each other.
def analyse(
    elements: Ints, points: Floats, root: Ints | None = None, leaf: int = _LEAF
) -> Analysis:
    """Analyse the pattern of a matrix that couples the nodes of each element.

    Args:
        elements: Nodes of each element, negative if fixed, shape (m, k).
        points: Position of each node, shape (n, 3) [m].
        root: Nodes that are eliminated last, some but not all; None lets the dissection choose.
        leaf: Largest number of nodes of a part that is not cut any further.
    """
    n = len(points)
    graph = graph_of_elements(elements, n)
    parts = dissect(points, graph, leaf) if root is None else _around(root, points, graph, leaf)
    order = np.concatenate([part.own for part in parts])
    place = np.empty(n, dtype=np.int64)
    place[order] = np.arange(n)
    borders = [place[border] for border in borders_of(graph, parts)]
    ends: list[int] = np.cumsum([len(part.own) for part in parts]).tolist()
    lower = sp.csc_array(sp.tril(graph[order][:, order]))
    lower.sort_indices()
    starts, rows = lower.indptr.astype(np.int64), lower.indices.astype(np.int64)
    places = np.empty(len(rows), dtype=np.int64)
    halves = _halves(parts)
    updates, workspace = _places_of_updates(parts, borders, halves)
    local = np.full(n, -1, dtype=np.int64)
    fronts: list[Front] = []
    where, inner = [np.empty((0, 2), dtype=np.int64)] * len(parts), [0] * len(parts)
    start = 0
    for part, border, last, update in zip(parts, borders, ends, updates, strict=True):
        first = last - len(part.own)
        own = np.arange(first, last)
        local[own], local[border] = own - first, len(own) + np.arange(len(border))
        span = slice(starts[first], starts[last])
        places[span] = local[rows[span]]
        for child in part.children:
            there = local[borders[child]]
            inner[child] = int((there < len(own)).sum())
            where[child] = _with_ends_of_runs(there, inner[child])
        fronts.append(Front(first, last, border, part.children, start, update))
        start += 9 * len(own) * (len(own) + len(border))
    firsts = np.cumsum([0] + [len(w) for w in where])
    of_fronts = np.cumsum([0] + [len(front.children) for front in fronts])
    table = [
        [f.first, f.last, len(f.border), f.start, f.update, at, among, one, other]
        for f, at, among, one, other in zip(
            fronts, firsts[:-1], inner, of_fronts[:-1], of_fronts[1:], strict=True
        )
    ]
    children = np.array([c for front in fronts for c in front.children], dtype=np.int64)
    return Analysis(
        order,
        starts,
        rows,
        places,
        fronts,
        np.array(table, dtype=np.int64),
        np.concatenate(where),
        children,
        np.concatenate(borders),
        halves,
        start,
        workspace,
    )


def _halves(parts: list[Part]) -> tuple[int, int]:
    """Return `Analysis.halves` for the separator nearest to the root that has two children."""
    k = len(parts) - 1
    while len(parts[k].children) == 1:
        k = parts[k].children[0]
    ends = [child + 1 for child in parts[k].children[:2]]
    return (ends[0], ends[1]) if ends else (0, 0)


def _with_ends_of_runs(where: Ints, inner: int) -> Ints:
    """Return the rows of `Analysis.where` for one front; no run crosses the index `inner`.

    Args:
        where: Row in the parent of each border node of the front, in nodes, shape (k,).
        inner: Number of these nodes that the parent eliminates.
    """
    k = len(where)
    begins = np.ones(k + 1, dtype=np.bool_)
    begins[1:k] = np.diff(where) != 1
    begins[inner] = True
    following = np.flatnonzero(begins)
    ends = following[np.searchsorted(following, np.arange(k), side="right")]
    return np.stack([where, ends], axis=1)


def _places_of_updates(
    parts: list[Part], borders: list[Ints], halves: tuple[int, int]
) -> tuple[list[int], int]:
    """Place the update of each front in the first gap of the workspace that is large enough.

    An update exists from the elimination of its front to that of the parent. The two halves of the
    tree have separate regions, since two threads may eliminate them at the same time.

    Returns:
        Index in the workspace at which each update begins, and the size of the workspace.
    """
    live: dict[int, tuple[int, int]] = {}
    places: list[int] = []
    size = base = 0
    for k, (part, border) in enumerate(zip(parts, borders, strict=True)):
        if k in halves:
            base = size
        length, at = 9 * len(border) ** 2, base
        for begin, end in sorted(live.values()):
            if begin - at >= length:
                break
            at = max(at, end)
        for child in part.children:
            del live[child]
        live[k] = (at, at + length)
        places.append(at)
        size = max(size, at + length)
    return places, size


def graph_of_elements(elements: Ints, n: int) -> sp.csr_array:
    """Return the graph that links nodes that share an element, and each node to itself, (n, n).

    Args:
        elements: Nodes of each element, negative if fixed, shape (m, k).
        n: Number of nodes.
    """
    k = elements.shape[1]
    row, column = np.repeat(elements, k, axis=1).ravel(), np.tile(elements, (1, k)).ravel()
    kept = (row >= 0) & (column >= 0)
    row, column = np.append(row[kept], np.arange(n)), np.append(column[kept], np.arange(n))
    ones = np.ones(len(row), dtype=np.int32)
    return sp.csr_array(sp.coo_array((ones, (row, column)), shape=(n, n)))


def _around(root: Ints, points: Floats, graph: sp.csr_array, leaf: int) -> list[Part]:
    """Dissect the nodes outside of `root`, and append `root` as the last part."""
    rest = np.setdiff1d(np.arange(len(points)), root)
    parts = [
        Part(rest[part.own], part.children)
        for part in dissect(points[rest], sp.csr_array(graph[rest][:, rest]), leaf)
    ]
    return [*parts, Part(root, (len(parts) - 1,))]


def dofs(nodes: Ints) -> Ints:
    """Return the three degrees of freedom of each of k nodes, shape (3 k,)."""
    return np.asarray((3 * nodes[:, None] + np.arange(3)).ravel(), dtype=np.int64)


def graph_of(matrix: sp.csr_array) -> sp.csr_array:
    """Return the graph that links nodes with a nonzero 3x3 block in a matrix, shape (n, n)."""
    n = matrix.shape[0] // 3
    rows = np.repeat(np.arange(3 * n, dtype=np.int32) // 3, np.diff(matrix.indptr))
    ones = np.ones(matrix.nnz, dtype=np.int8)
    graph = sp.csr_array(sp.coo_array((ones, (rows, matrix.indices // 3)), shape=(n, n)))
    return graph


def borders_of(graph: sp.csr_array, parts: list[Part]) -> list[Ints]:
    """Find the border of each part: nodes of ancestors that its elimination couples to it.

    Returns:
        Border of each part, with its nodes in the order of elimination.
    """
    position = np.empty(graph.shape[0], dtype=np.int64)
    position[np.concatenate([part.own for part in parts])] = np.arange(graph.shape[0])
    last = -1
    borders: list[Ints] = []
    for part in parts:
        last += len(part.own)
        coupled = [np.asarray(graph[part.own].indices, dtype=np.int64)]
        met = np.unique(np.concatenate(coupled + [borders[child] for child in part.children]))
        met = met[position[met] > last]
        borders.append(met[np.argsort(position[met])])
    return borders
