"""Product of a sparse symmetric matrix of 3x3 blocks with vectors.

The module is compiled if a compiler is available (`blocks.pxd` has the types). Indices are those of
an `Analysis` and are not checked here.
"""

from __future__ import annotations

from cohaptic_server.numeric import Floats, Ints


def multiply(blocks: Floats, starts: Ints, rows: Ints, x: Floats, out: Floats) -> None:
    """Multiply a sparse symmetric matrix by the columns of `x`.

    Args:
        blocks: Blocks on and below the diagonal, column after column, each row by row, shape
            (e, 9); diagonal blocks are symmetric.
        starts: Index of the first block of each of n block columns, the diagonal block, shape
            (n + 1,).
        rows: Block row of each block, shape (e,).
        x: Vectors, one in each column, shape (3 n, r).
        out: Receives the product, shape (3 n, r).
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
