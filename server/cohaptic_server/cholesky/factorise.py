"""Cholesky factorisation for solves on the retained nodes, and compliances of presses from it.

The matrix is sparse, symmetric and positive definite. If neither a front nor its descendants have a
retained node, the front is discarded after its elimination, since no later solve needs it. All
arithmetic is done in place, in the array of the factor and in the updates that wait for their
parent fronts. `plan.py` computes the size of this memory in advance, and no other array of the size
of a front exists.

A press is a set of forces on a few nodes, in one direction, that sum to 1. Forward substitution
alone gives the compliance between two presses f and g, for the matrix K = L D L' (`factor.py`):

    f' K^-1 g = sum over the fronts of y_f' y_g,    y_f = lower^-1 (L^-1 f) in each front

A press reaches only the fronts on its path to the root, and needs no backward substitution: its
self-compliance takes a fraction of the time that its displacement field would take. Many presses
are substituted at a time, in all three directions, so that BLAS does the arithmetic; a front
handles only the presses that reach it.
"""

from __future__ import annotations

import mmap
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple, cast

import numpy as np
import scipy.linalg
import scipy.sparse as sp

from cohaptic.errors import BodyError
from cohaptic_server.cholesky.factor import Factor, FactorFront
from cohaptic_server.cholesky.plan import Plan, plan_of
from cohaptic_server.cholesky.symbolic import dofs, graph_of
from cohaptic_server.cholesky.values import AnyFloats
from cohaptic_server.numeric import Floats, Ints, Mask

_ROWS = 128  # rows of an update added at a time: numpy copies the rows that indices select
_PAGES = 2**18  # bytes; smaller arrays come from the heap


class _Front(NamedTuple):
    """The blocks of a front, which change in place; a symmetric block has one valid half.

    Args:
        lower: Lower half of the front's own block, by columns, shape (a, a).
        carry: Block of the border's rows and the own columns, by rows, shape (b, a).
        update: Upper half of the front's update to its border, by rows, shape (b, b).
    """

    lower: Floats
    carry: Floats
    update: Floats


def factorise(
    matrix: sp.csr_array,
    points: Floats,
    retained: Mask,
    progress: Callable[[float], None] = lambda fraction: None,
    plan: Plan | None = None,
) -> Factor:
    """Compute the Cholesky factor of a symmetric positive definite matrix of 3x3 blocks.

    Args:
        matrix: The matrix, shape (3 n, 3 n).
        points: Position of each node, shape (n, 3) [m].
        retained: Whether a node is retained, since forces act on it and its displacement is
            observed, shape (n,).
        progress: Receives the completed fraction of the arithmetic, from 0 to 1.
        plan: Result of `plan_of` for this matrix, points and nodes; None computes it.

    Raises:
        BodyError: The matrix is not positive definite.
    """
    plan = plan or plan_of(graph_of(matrix), points, retained)
    # One array, whose pages take memory when they are written; many arrays would leave gaps
    # between the updates.
    numbers = _zeros(plan.factor_bytes // 8)
    fronts = _eliminate(matrix, plan, numbers, progress)
    front_of = np.empty(len(points), dtype=np.int64)
    for k, part in enumerate(plan.parts):
        front_of[part.own] = k
    return Factor(fronts, front_of, numbers)


def _eliminate(
    matrix: sp.csr_array, plan: Plan, numbers: Floats, progress: Callable[[float], None]
) -> list[FactorFront]:
    local = np.full(matrix.shape[0], -1, dtype=np.int64)
    updates: dict[int, Floats] = {}
    fronts: list[FactorFront] = []
    start = 0
    nothing: Floats = np.empty((0, 0))
    for k, (part, border_nodes) in enumerate(zip(plan.parts, plan.borders, strict=True)):
        own, border = dofs(part.own), dofs(border_nodes)
        a, b = len(own), len(border)
        kept = bool(plan.kept[k])
        place = numbers[start : start + a * (a + b)] if kept else _zeros(a * (a + b))
        start += len(place) if kept else 0
        front = _Front(
            place[: a * a].reshape((a, a), order="F"),
            place[a * a :].reshape((b, a)),
            _zeros(b * b).reshape((b, b)),
        )
        _assemble(front, matrix, own, border, local)
        for child in part.children:
            _add(front, updates.pop(child), local[fronts[child].border])
        local[own] = local[border] = -1
        _partial_factor(front)
        updates[k] = front.update
        lower, carry = (front.lower, front.carry) if kept else (nothing, nothing)
        fronts.append(FactorFront(own, border, lower, carry, int(plan.parents[k]), kept))
        progress(float(plan.work[k] / plan.work[-1]))
    return fronts


def _assemble(front: _Front, matrix: sp.csr_array, own: Ints, border: Ints, local: Ints) -> None:
    """Write the columns of a front's own unknowns from the matrix to the front.

    `local` is set to the position in the front of each own and border unknown.
    """
    a = len(own)
    local[own], local[border] = np.arange(a), a + np.arange(len(border))
    rows = matrix[own]
    at = local[rows.indices]
    row = np.repeat(np.arange(a), np.diff(rows.indptr))
    # Unknowns of descendants are eliminated already, and contained in the updates.
    inside, beyond = (at >= 0) & (at < a), at >= a
    front.lower[at[inside], row[inside]] = rows.data[inside]
    front.carry[at[beyond] - a, row[beyond]] = rows.data[beyond]


def _add(front: _Front, update: Floats, at: Ints) -> None:
    """Add a child's update to its parent's front.

    Args:
        front: Front of the parent.
        update: Update of the child, whose upper half is valid, shape (c, c).
        at: Positions of the child's border in the parent's front, rising, shape (c,).
    """
    a = len(front.lower)
    count = int((at < a).sum())
    inner, outer = at[:count], at[count:] - a
    for first in range(0, count, _ROWS):
        some = slice(first, min(first + _ROWS, count))
        # The lower half of a matrix by columns is the upper half of its transpose by rows.
        front.lower.T[inner[some, None], inner] += update[some, :count]
        front.carry[outer[:, None], inner[some]] += update[some, count:].T
    for first in range(0, len(outer), _ROWS):
        some = slice(first, min(first + _ROWS, len(outer)))
        front.update[outer[some, None], outer] += update[count:][some, count:]


def _partial_factor(front: _Front) -> None:
    """Eliminate a front's own unknowns: compute its `lower`, its `carry` and its `update`."""
    lower, right = front.lower, front.carry.T
    if not len(lower):  # a part without own nodes: BLAS takes no empty arrays
        return
    potrf, trsm, syrk = _routines()
    _, failed = potrf(lower, lower=1, clean=1, overwrite_a=1)
    if failed:
        raise BodyError("the stiffness is not positive definite: the object can move")
    if not len(front.update):
        return
    # All arrays are given by columns, so that BLAS writes into them without a copy.
    trsm(1.0, lower, right, lower=1, overwrite_b=1)
    syrk(-1.0, right, beta=1.0, c=front.update.T, trans=1, lower=1, overwrite_c=1)
    trsm(1.0, lower, right, lower=1, trans_a=1, overwrite_b=1)


def _zeros(count: int) -> Floats:
    """Return zeros in pages that take memory when written, and return it when released.

    Numpy takes some arrays from a heap, where released arrays leave gaps: 0.15 of a large factor.
    """
    if 8 * count < _PAGES:
        return np.zeros(count)
    return np.frombuffer(mmap.mmap(-1, 8 * count), dtype=np.float64)


def _routines() -> tuple[Any, Any, Any]:
    double = np.empty(0)
    potrf = cast(Any, scipy.linalg.get_lapack_funcs("potrf", (double,)))
    trsm, syrk = cast(Any, scipy.linalg.get_blas_funcs(("trsm", "syrk"), (double,)))
    return potrf, trsm, syrk


Report = Callable[[float], None]  # receives the completed fraction of the work, up to 1


class _Reached(NamedTuple):
    """Result of the forward substitution in one front.

    Args:
        presses: Presses that reach the front, rising, shape (m,).
        y: Vector lower^-1 (L^-1 f) for each press f in x, y and z, shape (a, 3 m).
    """

    presses: Ints
    y: AnyFloats


class _Passed(NamedTuple):
    """Forces that a front passes to its parent.

    Args:
        rows: Degrees of freedom of the front's border, shape (b,).
        presses: Presses that reach the front, shape (m,).
        forces: Forces from each press in x, y and z, shape (b, 3 m).
    """

    rows: Ints
    presses: Ints
    forces: AnyFloats


def self_compliance(
    factor: Factor, fractions: sp.csr_array, progress: Report = lambda fraction: None
) -> Floats:
    """Compute the self-compliance of each press: its own mean displacement per unit of force.

    Args:
        factor: Factor of the stiffness matrix.
        fractions: Share of each node in the force of each press, zero if not retained, shape (n,
            r).
        progress: Receives the completed fraction of the work.

    Returns:
        Displacement by 1 N in x, y and z, averaged over the press; symmetric, zero for a press
        without nodes, shape (r, 3, 3) [m/N].
    """
    out = np.zeros((fractions.shape[1], 3, 3))
    for presses, y in _solved_fronts(factor, fractions, progress):
        axes = [np.ascontiguousarray(y[:, axis::3]) for axis in range(3)]
        for i in range(3):
            for j in range(i + 1):
                sums = np.einsum("am,am->m", axes[i], axes[j])
                out[presses, i, j] += sums
                if i != j:
                    out[presses, j, i] += sums
    return out / factor.multiple


def mutual_compliance(
    factor: Factor, fractions: sp.csr_array, progress: Report = lambda fraction: None
) -> Floats:
    """Compute the compliance between all pairs of presses.

    Args:
        factor: Factor of the stiffness matrix.
        fractions, progress: As in `self_compliance`.

    Returns:
        Mean displacement of each press in x, y and z by 1 N on each press; symmetric, shape
        (3 r, 3 r) [m/N].
    """
    out = np.zeros((3 * fractions.shape[1], 3 * fractions.shape[1]))
    for presses, y in _solved_fronts(factor, fractions, progress):
        columns = dofs(presses)
        out[columns[:, None], columns] += y.T @ y
    return out / factor.multiple


def _solved_fronts(factor: Factor, fractions: sp.csr_array, progress: Report) -> Iterator[_Reached]:
    """Yield the forward substitution of all presses, front by front from the leaves to the root."""
    fractions = sp.csr_array(fractions)
    path = factor.path(np.flatnonzero(np.diff(fractions.indptr)))
    work = np.cumsum([f.lower.size + f.carry.size for f in map(factor.fronts.__getitem__, path)])
    local = np.empty(factor.size, dtype=np.int64)
    waiting: dict[int, list[_Passed]] = {}
    for k, done in zip(path, work.tolist(), strict=True):
        front = factor.fronts[k]
        presses, own, border = _gather(front, fractions, waiting.pop(k, []), local)
        if len(front.border):
            border -= front.carry @ own
            waiting.setdefault(front.parent, []).append(_Passed(front.border, presses, border))
        yield _Reached(presses, solve_lower(front.lower, own))
        progress(done / work[-1])


def _gather(
    front: FactorFront, fractions: sp.csr_array, passed: list[_Passed], local: Ints
) -> tuple[Ints, AnyFloats, AnyFloats]:
    """Gather the forces by each press on a front, before the front is eliminated.

    Args:
        fractions: Share of each node in the force of each press.
        passed: Forces that the front's children pass on.
        local: Scratch memory for positions in a front, shape (3 n,).

    Returns:
        The presses that reach the front, shape (m,); forces on its own unknowns, shape (a, 3 m),
        and on its border, shape (b, 3 m).
    """
    a, b = len(front.own), len(front.border)
    rows = fractions[front.own[::3] // 3]
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
        # A border is in order of elimination: a child's begins with own unknowns of the parent.
        at = local[one.rows]
        count = int((at < a).sum())
        _add_forces(own, at[:count], presses, one, one.forces[:count])
        _add_forces(border, at[count:] - a, presses, one, one.forces[count:])
    return presses, own, border


def _add_forces(
    into: AnyFloats, rows: Ints, presses: Ints, one: _Passed, forces: AnyFloats
) -> None:
    """Add forces that a child passes to `rows` of the parent's array `into`."""
    if len(presses) == len(one.presses):
        into[rows] += forces
    else:
        into[rows[:, None], dofs(np.searchsorted(presses, one.presses))] += forces


def solve_lower(lower: AnyFloats, right: AnyFloats) -> AnyFloats:
    """Solve `lower` x = `right` for x, shape (a, r); `right` is overwritten.

    Args:
        lower: Lower triangular matrix, shape (a, a).
        right: Right-hand sides, shape (a, r).
    """
    # `right` is stored by rows: BLAS gets its transpose, so nothing is copied.
    trsm = cast(Any, scipy.linalg.get_blas_funcs("trsm", (lower, right)))
    solved = trsm(1.0, lower, right.T, side=1, lower=1, trans_a=1, overwrite_b=1)
    return cast(AnyFloats, solved.T)
