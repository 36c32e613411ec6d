"""Factorises a sparse symmetric positive definite matrix for solves on a part of its nodes.

Fronts without a retained node among them or their descendants are not kept once they are
eliminated: no later solve needs them.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy.linalg
import scipy.sparse as sp

from cohaptic.errors import BodyError
from cohaptic_server.cholesky.dissection import Part, dissect
from cohaptic_server.cholesky.factor import Factor, FactorFront
from cohaptic_server.cholesky.symbolic import borders_of, dofs, graph_of
from cohaptic_server.numeric import Floats, Ints, Mask


def factorise(
    matrix: sp.csr_array,
    points: Floats,
    retained: Mask,
    progress: Callable[[float], None] = lambda share: None,
) -> Factor:
    """The Cholesky factor of a symmetric positive definite matrix of 3x3 blocks.

    Args:
        matrix: Shape (3 n, 3 n).
        points: Position of each node, shape (n, 3) [m].
        retained: Nodes that forces act on and whose displacement is observed, shape (n,).
        progress: Receives the completed share of the arithmetic, from 0 to 1.

    Raises:
        BodyError: The matrix is not positive definite.
    """
    graph = graph_of(matrix)
    parts = _split_leaves(dissect(points, graph), retained)
    fronts = _eliminate(matrix, parts, borders_of(graph, parts), retained, progress)
    front_of = np.empty(len(points), dtype=np.int64)
    for k, part in enumerate(parts):
        front_of[part.own] = k
    return Factor(fronts, front_of)


def _split_leaves(parts: list[Part], retained: Mask) -> list[Part]:
    """Cut leaves in two, their other nodes below the retained ones, so that no solve needs those.

    Args:
        parts: Children before their parents.
        retained: Shape (n,).
    """
    out: list[Part] = []
    index: list[int] = []
    for part in parts:
        own, children = part.own, tuple(index[child] for child in part.children)
        if not children and 0 < retained[own].sum() < len(own):
            out.append(Part(own[~retained[own]], ()))
            own, children = own[retained[own]], (len(out) - 1,)
        index.append(len(out))
        out.append(Part(own, children))
    return out


def _eliminate(
    matrix: sp.csr_array,
    parts: list[Part],
    borders: list[Ints],
    retained: Mask,
    progress: Callable[[float], None],
) -> list[FactorFront]:
    sizes = [(3 * len(part.own), 3 * len(b)) for part, b in zip(parts, borders, strict=True)]
    work = np.cumsum([a**3 / 3 + a * a * b + a * b * b for a, b in sizes])
    parents = np.full(len(parts), -1)
    for k, part in enumerate(parts):
        for child in part.children:
            parents[child] = k
    local = np.full(matrix.shape[0], -1, dtype=np.int64)
    updates: dict[int, Floats] = {}
    fronts: list[FactorFront] = []
    for k, (part, border_nodes) in enumerate(zip(parts, borders, strict=True)):
        own, border = dofs(part.own), dofs(border_nodes)
        dense = _assemble(matrix, own, border, local)
        for child in part.children:
            rows = local[fronts[child].border]
            dense[np.ix_(rows, rows)] += updates.pop(child)
        local[own] = local[border] = -1
        lower, half, updates[k] = _partial_factor(dense, len(own))
        keep = bool(retained[part.own].any()) or any(fronts[c].retained for c in part.children)
        if keep:
            carry = np.ascontiguousarray(_triangular_solve(lower, half.T, transposed=True).T)
        else:
            lower, carry = np.empty((0, 0)), np.empty((0, 0))
        fronts.append(FactorFront(own, border, lower, carry, int(parents[k]), keep))
        progress(float(work[k] / work[-1]))
    return fronts


def _assemble(matrix: sp.csr_array, own: Ints, border: Ints, local: Ints) -> Floats:
    """The matrix' own columns of a front, shape (a + b, a + b); fills `local` for its unknowns."""
    both = np.concatenate([own, border])
    local[both] = np.arange(len(both))
    dense = np.zeros((len(both), len(both)))
    rows = matrix[own]
    at = local[rows.indices]
    # Unknowns of descendants are eliminated already; their updates contain them.
    kept = at >= 0
    row = np.repeat(np.arange(len(own)), np.diff(rows.indptr))
    dense[at[kept], row[kept]] = rows.data[kept]
    return dense


def _partial_factor(dense: Floats, a: int) -> tuple[Floats, Floats, Floats]:
    """Eliminate the first `a` unknowns of a front.

    Returns:
        Cholesky factor L11 (a, a), K21 L11^-T (b, a), and the update of the border (b, b).
    """
    try:
        lower = np.asarray(
            scipy.linalg.cholesky(dense[:a, :a], lower=True, check_finite=False), dtype=np.float64
        )
    except scipy.linalg.LinAlgError as error:
        raise BodyError("the stiffness is not positive definite: the object can move") from error
    half = _triangular_solve(lower, dense[a:, :a].T).T
    return lower, half, dense[a:, a:] - half @ half.T


def _triangular_solve(lower: Floats, right: Floats, *, transposed: bool = False) -> Floats:
    x = scipy.linalg.solve_triangular(
        lower, right, lower=True, trans=1 if transposed else 0, check_finite=False
    )
    return np.asarray(x, dtype=np.float64)
