"""Elimination of the fronts of a sparse symmetric matrix of 3x3 blocks.

The module is compiled if a compiler is available (`elimination.pxd` has the types), and then runs
without the global interpreter lock, so that two threads can eliminate fronts that do not depend on
each other. Indices are those of an `Analysis` and are not checked here. Dense matrices are stored
column by column.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from cohaptic_server.cholesky import dense
from cohaptic_server.cholesky.values import AnyFloats
from cohaptic_server.numeric import Floats, Ints

if TYPE_CHECKING:
    from cohaptic_server import plain_cython as cython
else:
    try:
        import cython
    except ModuleNotFoundError:
        from cohaptic_server import plain_cython as cython


def eliminate(
    begin: int,
    end: int,
    table: Ints,
    where: Ints,
    children: Ints,
    starts: Ints,
    places: Ints,
    blocks: Floats,
    updates: AnyFloats,
    values: AnyFloats,
    routines: Ints,
) -> int:
    """Assemble and eliminate a range of fronts, one after the other.

    Args:
        begin: Index of the first front.
        end: Index after the last front.
        table, where, children, starts, places, blocks, updates, values: As in `load_front`.
        routines: Result of `dense.routines`.

    Returns:
        0 on success; 1 if the matrix is not positive definite.
    """
    with cython.nogil:
        for k in range(begin, end):
            load_front(k, table, where, children, starts, places, blocks, updates, values)
            width, height, at = 3 * (table[k, 1] - table[k, 0]), 3 * table[k, 2], table[k, 3]
            # The separator between parts of the mesh that are not coupled has no nodes.
            if width > 0 and dense.cholesky(routines, values, at, width) != 0:
                return 1
            if height > 0:
                if width > 0:
                    dense.divide_rows(routines, values, at, width, height)
                dense.negative_square(routines, values, at, width, height, updates, table[k, 4])
                add_updates(k, table, where, children, updates)
    return 0


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
    """Fill the columns of a front's own unknowns, from the matrix and from its children's updates.

    Args:
        k: Index of the front.
        table, where, children, starts, places: Arrays of these names in the `Analysis`.
        blocks: Blocks of the matrix, each row by row, shape (e, 9).
        updates: Workspace that holds the lower triangles of the children's updates.
        values: Values of the factor. The front's part of them is set: first the block of its own
            unknowns, of which the lower triangle is valid, then the rows of its border.
    """
    first, last, start = table[k, 0], table[k, 1], table[k, 3]
    width, height = 3 * (last - first), 3 * table[k, 2]
    below = start + width * width - width  # offset at which row `width` begins the border
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
    """Add to a front's update the entries of its children's updates that belong to its border.

    The arguments are those of `load_front`.
    """
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
