"""Symbolic analysis of a sparse Cholesky factor: everything that the pattern alone determines.

Each part of the tree of `dissection.py` is a dense front of its own nodes and of the border that
they have to their ancestors. A matrix whose entries change and whose pattern does not, such as the
tangent of a nonlinear solid, is analysed once and factored (`refactor.py`) many times.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from cohaptic_server.cholesky.dissection import Part, dissect
from cohaptic_server.numeric import Floats, Ints


@dataclass(frozen=True, eq=False)
class Child:
    """A front whose update is added to its parent, entry by entry of its lower triangle.

    Args:
        front: Index of the front in the list.
        own: Target indices in the parent's own block and, counted on, in the block below it.
        own_from: Their source indices in the update.
        rest: Target indices in the parent's update.
        rest_from: Their source indices in the update.
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
        border: Those of ancestors that they are coupled to, in order of elimination, shape (b,).
        entries: Its part of the analysis' entries.
        targets: Their indices in the own block (a, a) and, counted on, in the block below it
            (b, a), both column by column, shape (e,).
        children: Fronts whose updates are added to it.
    """

    own: Ints
    border: Ints
    entries: slice
    targets: Ints
    children: list[Child]


@dataclass(frozen=True, eq=False)
class Analysis:
    """The analysis of a pattern, ready for the numerical factorisation.

    Args:
        fronts: Children before their parents.
        entries: Indices into the matrix' data of the entries that a factorisation reads, shape
            (e,): of a symmetric pair it reads one.
        size: Number of unknowns.
    """

    fronts: list[Front]
    entries: Ints
    size: int


def analyse(matrix: sp.csr_array, points: Floats) -> Analysis:
    """Fronts for a symmetric matrix of 3x3 blocks; they take twice the memory of its factor.

    Args:
        matrix: Shape (3 n, 3 n), of symmetric pattern; its values have no effect.
        points: Position of each node, shape (n, 3) [m].
    """
    graph = graph_of(matrix)
    parts = dissect(points, graph)
    borders = [dofs(border) for border in borders_of(graph, parts)]
    local = np.full(matrix.shape[0], -1, dtype=np.int64)
    fronts: list[Front] = []
    read: list[Ints] = []
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
        # Unknowns of descendants are eliminated already; their updates contain them.
        kept = row >= column
        entries, row, column = entries[kept], row[kept], column[kept]
        targets = np.where(row < a, row + a * column, a * a + row - a + b * column)
        children: list[Child] = []
        for child in part.children:
            where = local[borders[child]]
            children.append(_child(child, where, a, b))
        local[own] = local[border] = -1
        own_entries = slice(count, count + len(entries))
        fronts.append(Front(own, border, own_entries, targets, children))
        read.append(entries)
        count += len(entries)
    return Analysis(fronts, np.concatenate(read), matrix.shape[0])


def _child(front: int, where: Ints, a: int, b: int) -> Child:
    """The map of a child's update into its parent.

    Args:
        front: Index of the child.
        where: Row of the parent for each row of the update, shape (k,).
        a: Number of the parent's own unknowns.
        b: Number of its bordering unknowns.
    """
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
    """The graph of coupled nodes of a matrix of 3x3 blocks, shape (n, n)."""
    n = matrix.shape[0] // 3
    rows = np.repeat(np.arange(3 * n), np.diff(matrix.indptr))[: matrix.nnz] // 3
    ones = np.ones(matrix.nnz, dtype=np.int8)
    graph = sp.csr_array(sp.coo_array((ones, (rows, matrix.indices // 3)), shape=(n, n)))
    return graph


def borders_of(graph: sp.csr_array, parts: list[Part]) -> list[Ints]:
    """Nodes of ancestors to which each part is coupled once its children are eliminated.

    Returns:
        For each part its border, in order of elimination.
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
