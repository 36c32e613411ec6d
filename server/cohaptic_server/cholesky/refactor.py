"""The Cholesky factor of a matrix whose pattern was analysed before: K = L L', by fronts.

`factor.py` is for a linear solid: factored once, and a tick solves for a few nodes. Here
the matrix is factored in many ticks and solved for all unknowns, and all that its pattern decides
is found before (`symbolic.py`). Dense arithmetic is LAPACK's, in single or in double precision.

The root may be left as it is: what is known of it then is its Schur complement, the matrix with all
other unknowns eliminated (`bordered.py`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import blas, lapack

from cohaptic.errors import BodyError
from cohaptic_server.cholesky.blocks import (
    add_updates,
    load_front,
    subtract_rows,
    take_rows,
)
from cohaptic_server.cholesky.symbolic import Analysis, Front
from cohaptic_server.cholesky.values import AnyFloats
from cohaptic_server.numeric import Floats

_LAPACK = {  # by the bytes of a value
    4: (lapack.spotrf, blas.strsm, blas.ssyrk),
    8: (lapack.dpotrf, blas.dtrsm, blas.dsyrk),
}
_LANES = 4


class Indefinite(BodyError):
    """The matrix is not positive definite: it has no Cholesky factor."""


@dataclass(frozen=True, eq=False)
class _Store:
    """The values of a factor, and its blocks as views of them."""

    values: AnyFloats
    fronts: list[tuple[Front, AnyFloats, AnyFloats]]


class Workspace:
    """The memory in which matrices of one pattern are factored, one at a time.

    A factor that is no longer in use leaves its memory to the next: fresh memory costs a fifth of
    the time of a factorisation.

    Args:
        analysis: Analysis of the pattern.
        single: Whether to factor in single precision, in half of the time.

    Attributes:
        analysis: As given.
        updates: Schur complements on their way to the parents.
        update_of: The update of each front, as a view.
    """

    def __init__(self, analysis: Analysis, *, single: bool = False) -> None:
        self.analysis = analysis
        self._dtype = np.dtype(np.float32 if single else np.float64)
        self.updates: AnyFloats = np.zeros(analysis.workspace, dtype=self._dtype)
        self.update_of = [
            _matrix(self.updates, front.update, front.height, front.height)
            for front in analysis.fronts
        ]
        self._free = list[_Store]()

    def take(self) -> _Store:
        """Memory for a factor."""
        if self._free:
            return self._free.pop()
        values: AnyFloats = np.empty(self.analysis.values, dtype=self._dtype)
        fronts = [
            (
                front,
                _matrix(values, front.start, front.width, front.width),
                _matrix(values, front.start + front.width**2, front.height, front.width),
            )
            for front in self.analysis.fronts
        ]
        return _Store(values, fronts)

    def give_back(self, store: _Store) -> None:
        """Memory of a factor that nobody uses any more."""
        self._free.append(store)


def _matrix(values: AnyFloats, start: int, rows: int, columns: int) -> AnyFloats:
    """A matrix that is stored column by column from `start` on."""
    return values[start : start + rows * columns].reshape((rows, columns), order="F")


class Refactored:
    """The factor of a symmetric positive definite matrix.

    Args:
        workspace: Memory for matrices of its pattern.
        blocks: Its blocks in the order of `analysis.rows`, shape (e, 9) [N/m].
        without_root: Whether to leave the root as it is.

    Attributes:
        root: Schur complement of the root's unknowns, its lower triangle, if that is not factored.

    Raises:
        Indefinite: The matrix is not positive definite.
    """

    def __init__(self, workspace: Workspace, blocks: Floats, *, without_root: bool = False) -> None:
        self._workspace, self._store = workspace, workspace.take()
        analysis, updates, values = workspace.analysis, workspace.updates, self._store.values
        potrf, self._trsm, self_product = _LAPACK[values.itemsize]
        table, where, children = analysis.table, analysis.where, analysis.children
        places = analysis.starts, analysis.places
        self._fronts = self._store.fronts[: -1 if without_root else None]
        for k, (_, lower, below) in enumerate(self._fronts):
            load_front(k, table, where, children, *places, blocks, updates, values)
            _, failed = potrf(lower, lower=1, clean=0, overwrite_a=1)
            if failed:
                raise Indefinite("the matrix is not positive definite")
            if len(below):
                self._trsm(1.0, lower, below, side=1, lower=1, trans_a=1, overwrite_b=1)
                self_product(-1.0, below, c=workspace.update_of[k], lower=1, overwrite_c=1)
                add_updates(k, table, where, children, updates)
        if without_root:
            root = len(table) - 1
            load_front(root, table, where, children, *places, blocks, updates, values)
        self.root = self._store.fronts[-1][1]

    def __del__(self) -> None:
        self._workspace.give_back(self._store)

    @property
    def bytes(self) -> int:
        """Memory of the factor."""
        return self._store.values.nbytes

    def solve(self, b: Floats) -> AnyFloats:
        """Solutions, shape (size, r), for right-hand sides `b` (size, r), in its own precision."""
        count = b.shape[1]
        # BLAS takes longer for three columns than for four, the width of its registers.
        width = count if count < _LANES else -(-count // _LANES) * _LANES
        padded: AnyFloats = np.zeros((len(b), width), dtype=self._store.values.dtype)
        padded[:, :count] = b
        x = self._forward_in_place(padded)
        self.backward(x)
        return x[:, :count]

    def forward(self, b: Floats) -> AnyFloats:
        """The solution y of L y = b; the rows of a root that is not factored are b less L21 y."""
        return self._forward_in_place(np.array(b, dtype=self._store.values.dtype, order="C"))

    def _forward_in_place(self, x: AnyFloats) -> AnyFloats:
        for front, lower, below in self._fronts:
            own = x[3 * front.first : 3 * front.last]
            self._trsm(1.0, lower, own.T, side=1, lower=1, trans_a=1, overwrite_b=1)
            if len(front.border):
                subtract_rows(below @ own, front.border, x)
        return x

    def backward(self, x: AnyFloats) -> None:
        """Solve L' z = x in place, shape (size, r); rows of a root that is not factored are z's."""
        for front, lower, below in reversed(self._fronts):
            own = x[3 * front.first : 3 * front.last]
            if len(front.border):
                rows: AnyFloats = np.empty((front.height, x.shape[1]), dtype=x.dtype)
                take_rows(x, front.border, rows)
                own -= below.T @ rows
            self._trsm(1.0, lower, own.T, side=1, lower=1, overwrite_b=1)
