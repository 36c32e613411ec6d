"""Loops over the 3x3 blocks of a sparse symmetric matrix and over the fronts of its factor.

Compiled where a compiler is at hand (`blocks.pxd` has the types). Indices are those of an
`Analysis` and are not checked here. Dense matrices are stored column by column.
"""

from __future__ import annotations

from cohaptic_server.cholesky.values import AnyFloats
from cohaptic_server.numeric import Floats, Ints


def load_front(
    k: int,
    table: Ints,
    where: Ints,
    children: Ints,
    starts: Ints,
    places: Ints,
    blocks: Floats,
    updates: AnyFloats,
    values: AnyFloats,
) -> None:
    """Write a front before its elimination: blocks of the matrix, and its children's updates.

    Args:
        k: The front.
        table: Of the analysis, as the following ones.
        where: Rows of the parents.
        children: Of all fronts.
        starts: First block of each column.
        places: Row of each block within the front.
        blocks: Shape (e, 9), row by row.
        updates: Workspace, with the lower triangles of the children's updates.
        values: Of the factor; those of the front become its own unknowns' lower triangle and the
            rows of its border.
    """
    first, last, start = table[k, 0], table[k, 1], table[k, 3]
    width, height = 3 * (last - first), 3 * table[k, 2]
    below = start + width * width - width  # of row `width`, the first one of the border
    for i in range(start, start + width * (width + height)):
        values[i] = 0.0
    for column in range(first, last):
        at = 3 * (column - first)
        for e in range(starts[column], starts[column + 1]):
            row = 3 * places[e]
            for j in range(3):
                if row < width:
                    target = start + row + (at + j) * width
                else:
                    target = below + row + (at + j) * height
                values[target] = blocks[e, j]
                values[target + 1] = blocks[e, 3 + j]
                values[target + 2] = blocks[e, 6 + j]
    for c in range(table[k, 7], table[k, 8]):
        child = children[c]
        nodes, inner, rows = table[child, 2], table[child, 6], table[child, 5]
        for q in range(inner):
            for j in range(3):
                column = 3 * where[rows + q, 0] + j
                source = table[child, 4] + 3 * nodes * (3 * q + j)
                p = q
                while p < nodes:
                    end = where[rows + p, 1]
                    row = 3 * where[rows + p, 0]
                    if row < width:
                        target = start + row + column * width
                    else:
                        target = below + row + column * height
                    for i in range(3 * (end - p)):
                        values[target + i] += updates[source + 3 * p + i]
                    p = end


def add_updates(k: int, table: Ints, where: Ints, children: Ints, updates: AnyFloats) -> None:
    """Add to the update of a front what its children have for its border; as `load_front`."""
    width, height = 3 * (table[k, 1] - table[k, 0]), 3 * table[k, 2]
    for c in range(table[k, 7], table[k, 8]):
        child = children[c]
        nodes, inner, rows = table[child, 2], table[child, 6], table[child, 5]
        for q in range(inner, nodes):
            for j in range(3):
                into = table[k, 4] + (3 * where[rows + q, 0] + j - width) * height - width
                source = table[child, 4] + 3 * nodes * (3 * q + j)
                p = q
                while p < nodes:
                    end = where[rows + p, 1]
                    target = into + 3 * where[rows + p, 0]
                    for i in range(3 * (end - p)):
                        updates[target + i] += updates[source + 3 * p + i]
                    p = end


def subtract_rows(rows: AnyFloats, border: Ints, x: AnyFloats) -> None:
    """Subtract the rows of each node of a border.

    Args:
        rows: Shape (3 k, r).
        border: Nodes, shape (k,).
        x: Unknowns, shape (3 n, r).
    """
    for p in range(len(border)):
        for i in range(3):
            for c in range(x.shape[1]):
                x[3 * border[p] + i, c] -= rows[3 * p + i, c]


def take_rows(x: AnyFloats, border: Ints, rows: AnyFloats) -> None:
    """The reverse of `subtract_rows`: copy the rows of each node of a border."""
    for p in range(len(border)):
        for i in range(3):
            for c in range(x.shape[1]):
                rows[3 * p + i, c] = x[3 * border[p] + i, c]


def multiply(blocks: Floats, starts: Ints, rows: Ints, x: Floats, out: Floats) -> None:
    """The product with a symmetric matrix.

    Args:
        blocks: Blocks on and below the diagonal, shape (e, 9); those on it are symmetric.
        starts: First block of each column, which is the one on the diagonal, shape (n + 1,).
        rows: Row of each block, shape (e,).
        x: Shape (3 n, r).
        out: The product, shape (3 n, r).
    """
    n = len(starts) - 1
    for i in range(3 * n):
        for c in range(x.shape[1]):
            out[i, c] = 0.0
    for column in range(n):
        v = 3 * column
        for e in range(starts[column], starts[column + 1]):
            u = 3 * rows[e]
            for c in range(x.shape[1]):
                a, b, d = x[v, c], x[v + 1, c], x[v + 2, c]
                out[u, c] += blocks[e, 0] * a + blocks[e, 1] * b + blocks[e, 2] * d
                out[u + 1, c] += blocks[e, 3] * a + blocks[e, 4] * b + blocks[e, 5] * d
                out[u + 2, c] += blocks[e, 6] * a + blocks[e, 7] * b + blocks[e, 8] * d
                if u != v:
                    a, b, d = x[u, c], x[u + 1, c], x[u + 2, c]
                    out[v, c] += blocks[e, 0] * a + blocks[e, 3] * b + blocks[e, 6] * d
                    out[v + 1, c] += blocks[e, 1] * a + blocks[e, 4] * b + blocks[e, 7] * d
                    out[v + 2, c] += blocks[e, 2] * a + blocks[e, 5] * b + blocks[e, 8] * d
