"""Forward and backward substitution through the fronts of a factor K = L L'.

The module is compiled if a compiler is available (`substitution.pxd` has the types), and then runs
without the global interpreter lock, as `elimination.py` does. Indices are those of an `Analysis`
and are not checked here.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from cohaptic_server.cholesky import dense
from cohaptic_server.cholesky.values import AnyFloats
from cohaptic_server.numeric import Ints

if TYPE_CHECKING:
    from cohaptic_server import plain_cython as cython
else:
    try:
        import cython
    except ModuleNotFoundError:
        from cohaptic_server import plain_cython as cython


def forward(
    begin: int,
    end: int,
    table: Ints,
    borders: Ints,
    shared: int,
    shift: int,
    values: AnyFloats,
    x: AnyFloats,
    scratch: AnyFloats,
    routines: Ints,
) -> None:
    """Solve L y = x in place for the unknowns of fronts, children before their parents.

    Args:
        begin: Index of the first front.
        end: Index after the last front.
        table: `Analysis.table`.
        borders: `Analysis.borders`, the border nodes of all fronts.
        shared: First of the nodes whose rows of `x` are updated `shift` rows further down.
        shift: Offset of these rows; 0 to update them in place.
        values: Values of the factor.
        x: Right-hand sides, replaced by y, shape (3 n or more, r).
        scratch: Scratch memory, shape (at least the largest height of a front, r).
        routines: Result of `dense.routines`.
    """
    with cython.nogil:
        for k in range(begin, end):
            row, width, at = 3 * table[k, 0], 3 * (table[k, 1] - table[k, 0]), table[k, 3]
            nodes, border = table[k, 2], table[k, 5]
            if width == 0:
                continue
            dense.forward(routines, values, at, width, x, row)
            if nodes > 0:
                dense.product(routines, values, at, width, 3 * nodes, x, row, scratch)
                for p in range(nodes):
                    node = borders[border + p]
                    to = 3 * node + shift if node >= shared else 3 * node
                    for i in range(3):
                        for c in range(x.shape[1]):
                            x[to + i, c] -= scratch[3 * p + i, c]


def backward(
    begin: int,
    end: int,
    table: Ints,
    borders: Ints,
    values: AnyFloats,
    x: AnyFloats,
    scratch: AnyFloats,
    routines: Ints,
) -> None:
    """Solve L' z = x in place for the unknowns of fronts, parents before their children.

    Args:
        begin: Index of the front that is solved last.
        end: Index after the front that is solved first.
        table, borders, values, x, scratch, routines: As in `forward`.
    """
    with cython.nogil:
        for back in range(end - begin):
            k = end - 1 - back
            row, width, at = 3 * table[k, 0], 3 * (table[k, 1] - table[k, 0]), table[k, 3]
            nodes, border = table[k, 2], table[k, 5]
            if width == 0:
                continue
            if nodes > 0:
                for p in range(nodes):
                    for i in range(3):
                        for c in range(x.shape[1]):
                            scratch[3 * p + i, c] = x[3 * borders[border + p] + i, c]
                dense.subtract_product(routines, values, at, width, 3 * nodes, x, row, scratch)
            dense.backward(routines, values, at, width, x, row)
