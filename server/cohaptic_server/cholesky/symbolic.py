"""Which front of a sparse Cholesky factor holds what: all of it that the pattern alone decides.

Each part of the tree of `dissection.py` is a dense front of its own nodes and of the border that
they have to their ancestors. A matrix whose entries change and whose pattern does not, as the
tangent of a nonlinear solid, is analysed once and factored (`refactoring.py`) over and over.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from cohaptic_server.cholesky.dissection import Part, dissect
from cohaptic_server.numeric import Floats, Ints


@dataclass(frozen=True, eq=False)
class Child:
    """A front whose update goes into its parent, entry by entry of its lower triangle.

    Args:
        front: Its place in the list.
        own: Places in the parent's own block and, counted on, in the block below it.
        own_from: Where in the update they come from.
        rest: Places in the parent's own update.
        rest_from: Where they come from.
    """

    front: int
    own: Ints
    own_from: Ints
    rest: Ints
    rest_from: Ints


@dataclass(frozen=True, eq=False)
class Front:
    """A dense block of the factor, as a pattern.

    Args:
        own: Degrees of freedom eliminated here, shape (a,).
        border: Those of ancestors that they meet, by order of elimination, shape (b,).
        entries: Which of the analysis' entries are its own.
        places: Where they go: first in the own block (a, a), then, counted on, in the block
            below it (b, a), both column by column, shape (e,).
        children: Whose updates it takes in.
    """

    own: Ints
    border: Ints
    entries: slice
    places: Ints
    children: list[Child]


@dataclass(frozen=True, eq=False)
class Analysis:
    """A pattern, ready for numbers.

    Args:
        fronts: Children before their parents.
        entries: Places in the matrix' data of what a factorisation reads, shape (e,): each pair of
            entries that are each other's mirror image is read once.
        size: How many unknowns there are.
    """

    fronts: list[Front]
    entries: Ints
    size: int


def analyse(matrix: sp.csr_array, points: Floats) -> Analysis:
    """Fronts for a symmetric matrix of 3x3 blocks; twice the memory of its factor.

    Args:
        matrix: Shape (3 n, 3 n); only its pattern counts, which is
            symmetric too.
        points: Place of each node, shape (n, 3) [m].
    """
    graph = graph_of(matrix)
    parts = dissect(points, graph)
    borders = [dofs(border) for border in borders_of(graph, parts)]
    local = np.full(matrix.shape[0], -1, dtype=np.int64)
    fronts: list[Front] = []
    found: list[Ints] = []
    count = 0
    for part, border in zip(parts, borders, strict=True):
        own = dofs(part.own)
        a, b = len(own), len(border)
        local[own], local[border] = np.arange(a), a + np.arange(b)
        starts, lengths = matrix.indptr[own], np.diff(matrix.indptr)[own]
        first = np.repeat(starts - np.cumsum(lengths) + lengths, lengths)
        entries = np.arange(int(lengths.sum())) + first
        column = np.repeat(np.arange(a), lengths)
        row = local[matrix.indices[entries]]
        # Below the children lies what was eliminated there: their updates carry it.
        kept = row >= column
        entries, row, column = entries[kept], row[kept], column[kept]
        places = np.where(row < a, row + a * column, a * a + row - a + b * column)
        children: list[Child] = []
        for child in part.children:
            where = local[borders[child]]
            children.append(_child(child, where, a, b))
        local[own] = local[border] = -1
        own_entries = slice(count, count + len(entries))
        fronts.append(Front(own, border, own_entries, places, children))
        found.append(entries)
        count += len(entries)
    return Analysis(fronts, np.concatenate(found), matrix.shape[0])


def _child(front: int, where: Ints, a: int, b: int) -> Child:
    """Of an update whose rows go to the rows `where` of a front of a own and b bordering ones."""
    k = len(where)
    column, row = np.triu_indices(k)  # the lower triangle, column by column
    source = row + k * column
    own = where[column] < a
    row, column = where[row], where[column]
    into = np.where(row < a, row + a * column, a * a + row - a + b * column)
    rest = row - a + b * (column - a)
    return Child(front, into[own], source[own], rest[~own], source[~own])


def dofs(nodes: Ints) -> Ints:
    """The three degrees of freedom of each node, shape (3 k,)."""
    return np.asarray((3 * nodes[:, None] + np.arange(3)).ravel(), dtype=np.int64)


def graph_of(matrix: sp.csr_array) -> sp.csr_array:
    """Which nodes meet, from a matrix of 3x3 blocks."""
    n = matrix.shape[0] // 3
    rows = np.repeat(np.arange(3 * n), np.diff(matrix.indptr))[: matrix.nnz] // 3
    ones = np.ones(matrix.nnz, dtype=np.int8)
    graph = sp.csr_array(sp.coo_array((ones, (rows, matrix.indices // 3)), shape=(n, n)))
    return graph


def borders_of(graph: sp.csr_array, parts: list[Part]) -> list[Ints]:
    """Nodes of ancestors that each part meets once its children are gone, by elimination order."""
    place = np.empty(graph.shape[0], dtype=np.int64)
    place[np.concatenate([part.own for part in parts])] = np.arange(graph.shape[0])
    last = -1
    borders: list[Ints] = []
    for part in parts:
        last += len(part.own)
        near = [np.asarray(graph[part.own].indices, dtype=np.int64)]
        met = np.unique(np.concatenate(near + [borders[child] for child in part.children]))
        met = met[place[met] > last]
        borders.append(met[np.argsort(place[met])])
    return borders
