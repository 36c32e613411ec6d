"""Computes the compliances of presses by forward substitution alone.

    f' K^-1 g = sum over the fronts of y_f' y_g,    y = lower^-1 (L^-1 f) of each front

A press is a set of forces on a few nodes, in one direction, that sum to 1. A press reaches only the
fronts on its path to the root, and needs no backward substitution: its self-compliance takes a
fraction of the time that its displacement field would take. Many presses are eliminated at a time,
in all three directions, so that BLAS does the arithmetic; a front handles only the presses that
reach it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple, cast

import numpy as np
import scipy.linalg
import scipy.sparse as sp

from cohaptic_server.cholesky.factor import Factor, FactorFront
from cohaptic_server.cholesky.symbolic import dofs
from cohaptic_server.cholesky.values import AnyFloats
from cohaptic_server.numeric import Floats, Ints

Report = Callable[[float], None]  # receives the completed share, up to 1


class _Reached(NamedTuple):
    """Result of the forward substitution in one front.

    Args:
        presses: Presses that reach the front, rising, shape (m,).
        y: Solution of each press in x, y, z, shape (a, 3 m).
    """

    presses: Ints
    y: AnyFloats


class _Passed(NamedTuple):
    """Forces that a front passes to its parent.

    Args:
        rows: Degrees of freedom of the front's border, shape (b,).
        presses: Presses that reach the front, shape (m,).
        forces: Forces by each press in x, y, z, shape (b, 3 m).
    """

    rows: Ints
    presses: Ints
    forces: AnyFloats


def self_compliance(
    factor: Factor, shares: sp.csr_array, progress: Report = lambda share: None
) -> Floats:
    """Compute the self-compliance of each press.

    Args:
        factor: Factor of K.
        shares: Share of each node in the force of each press, zero if not retained, shape (n, r).
        progress: Receives the completed share of the work.

    Returns:
        Displacement by 1 N in x, y, z, averaged over the press; symmetric, zero for a press without
        nodes, shape (r, 3, 3) [m/N].
    """
    out = np.zeros((shares.shape[1], 3, 3))
    for presses, y in _eliminate(factor, shares, progress):
        axes = [np.ascontiguousarray(y[:, axis::3]) for axis in range(3)]
        for i in range(3):
            for j in range(i + 1):
                sums = np.einsum("am,am->m", axes[i], axes[j])
                out[presses, i, j] += sums
                if i != j:
                    out[presses, j, i] += sums
    return out


def mutual_compliance(
    factor: Factor, shares: sp.csr_array, progress: Report = lambda share: None
) -> Floats:
    """Compute the compliance between all pairs of presses.

    Args:
        factor: Factor of K.
        shares, progress: As in `self_compliance`.

    Returns:
        Displacement of a press in x, y, z by 1 N on another; symmetric, shape (3 r, 3 r) [m/N].
    """
    out = np.zeros((3 * shares.shape[1], 3 * shares.shape[1]))
    for presses, y in _eliminate(factor, shares, progress):
        columns = dofs(presses)
        out[columns[:, None], columns] += y.T @ y
    return out


def _eliminate(factor: Factor, shares: sp.csr_array, progress: Report) -> Iterator[_Reached]:
    """Yield the forward substitution of all presses, front by front from the leaves to the root."""
    shares = sp.csr_array(shares)
    path = factor.path(np.flatnonzero(np.diff(shares.indptr)))
    work = np.cumsum([f.lower.size + f.carry.size for f in map(factor.fronts.__getitem__, path)])
    local = np.empty(factor.size, dtype=np.int64)
    waiting: dict[int, list[_Passed]] = {}
    for k, done in zip(path, work.tolist(), strict=True):
        front = factor.fronts[k]
        presses, own, border = _gather(front, shares, waiting.pop(k, []), local)
        if len(front.border):
            border -= front.carry @ own
            waiting.setdefault(front.parent, []).append(_Passed(front.border, presses, border))
        yield _Reached(presses, solve_lower(front.lower, own))
        progress(done / work[-1])


def _gather(
    front: FactorFront, shares: sp.csr_array, passed: list[_Passed], local: Ints
) -> tuple[Ints, AnyFloats, AnyFloats]:
    """Gather the forces by each press on a front, before the front is eliminated.

    Args:
        shares: Share of each node in the force of each press.
        passed: Forces that the front's children pass on.
        local: Scratch, shape (3 n,).

    Returns:
        The presses that reach the front, shape (m,); forces on its own unknowns, shape (a, 3 m),
        and on its border, shape (b, 3 m).
    """
    a, b = len(front.own), len(front.border)
    rows = shares[front.own[::3] // 3]
    presses = np.unique(np.concatenate([rows.indices, *(one.presses for one in passed)]))
    presses = presses.astype(np.int64)
    own = np.zeros((a, 3 * len(presses)), dtype=front.lower.dtype)
    border = np.zeros((b, 3 * len(presses)), dtype=front.lower.dtype)
    row = np.repeat(np.arange(a // 3), np.diff(rows.indptr))
    column = np.searchsorted(presses, rows.indices)
    for axis in range(3):
        own[3 * row + axis, 3 * column + axis] = rows.data
    local[front.own], local[front.border] = np.arange(a), a + np.arange(b)
    for one in passed:
        # Borders are in order of elimination: a child's begins with own unknowns of its parent.
        at = local[one.rows]
        count = int((at < a).sum())
        _add(own, at[:count], presses, one, one.forces[:count])
        _add(border, at[count:] - a, presses, one, one.forces[count:])
    return presses, own, border


def _add(into: AnyFloats, rows: Ints, presses: Ints, one: _Passed, forces: AnyFloats) -> None:
    """Add forces that a child passes to `rows` of the parent's array `into`."""
    if len(presses) == len(one.presses):
        into[rows] += forces
    else:
        into[rows[:, None], dofs(np.searchsorted(presses, one.presses))] += forces


def solve_lower(lower: AnyFloats, right: AnyFloats) -> AnyFloats:
    """Return lower^-1 right for a triangular matrix `lower`; `right` is overwritten."""
    # `right` is stored by rows: BLAS gets its transpose, so nothing is copied.
    trsm = cast(Any, scipy.linalg.get_blas_funcs("trsm", (lower, right)))
    solved = trsm(1.0, lower, right.T, side=1, lower=1, trans_a=1, overwrite_b=1)
    return cast(AnyFloats, solved.T)
