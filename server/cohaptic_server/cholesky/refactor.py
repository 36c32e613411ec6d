"""A sparse Cholesky factor K = L L' of a matrix K whose pattern was analysed before.

The factor of `factor.py` is for a linear solid: it is computed once, and a tick solves for a few
nodes. Here a new matrix is factored in many ticks and solved for all unknowns; `symbolic.py`
computes in advance everything that the pattern determines. LAPACK does the dense arithmetic, in
single or in double precision. Two threads factor the two halves of a large matrix
(`side_by_side.py`).

The root may be left unfactored. The factor then holds the root's Schur complement, the matrix with
all other unknowns eliminated (`bodies/balloon/rubber_balloon.py`).
"""

from __future__ import annotations

import numpy as np

from cohaptic.errors import BodyError
from cohaptic_server.cholesky import substitution
from cohaptic_server.cholesky.dense import routines
from cohaptic_server.cholesky.elimination import eliminate, load_front
from cohaptic_server.cholesky.symbolic import Analysis
from cohaptic_server.cholesky.values import AnyFloats
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.side_by_side import both

_LANES = 4
# Values of a factor below which a second thread saves less time than waking it up takes.
_WORTH_TWO_THREADS = 300_000


class Indefinite(BodyError):
    """The matrix is not positive definite, so it has no Cholesky factor."""


class Workspace:
    """The memory in which matrices of one pattern are factored, one at a time.

    The next factor reuses the memory of a factor that has ended, since fresh memory would cost a
    fifth of the time of a factorisation.

    Args:
        analysis: Analysis of the pattern.
        single: Whether to factor in single precision, in half of the time.

    Attributes:
        dtype: Type of the values.
        updates: Memory for the updates that fronts leave to their parents.
        routines: Addresses of routines of BLAS and LAPACK for this precision (`dense.routines`).
        halves: `Analysis.halves`, one half for each of two threads; (0, 0) for a small factor.
        scratch_rows: Largest number of rows in the border of a front.
    """

    def __init__(self, analysis: Analysis, *, single: bool = False) -> None:
        self.analysis = analysis
        self.dtype = np.dtype(np.float32 if single else np.float64)
        self.updates: AnyFloats = np.zeros(analysis.workspace, dtype=self.dtype)
        self.routines = routines(single)
        self.halves = analysis.halves if analysis.values >= _WORTH_TWO_THREADS else (0, 0)
        self.scratch_rows = max(1, *(front.height for front in analysis.fronts))
        self._free = list[AnyFloats]()

    def take(self) -> AnyFloats:
        """Return memory for the values of one factor, shape (`analysis.values`,)."""
        return self._free.pop() if self._free else np.empty(self.analysis.values, self.dtype)

    def give_back(self, values: AnyFloats) -> None:
        """Take back the memory of a factor that is no longer in use."""
        self._free.append(values)


class Refactored:
    """The factor of a symmetric positive definite matrix.

    Args:
        workspace: Memory for matrices of the same pattern.
        blocks: Blocks of the matrix in the order of `analysis.rows`, shape (e, 9) [N/m].
        without_root: Whether to leave the root unfactored.

    Attributes:
        root: Lower triangle of the Schur complement of the root's unknowns, if `without_root`.

    Raises:
        Indefinite: The matrix is not positive definite.
    """

    def __init__(self, workspace: Workspace, blocks: Floats, *, without_root: bool = False) -> None:
        self._workspace, self._values = workspace, workspace.take()
        analysis, updates, values = workspace.analysis, workspace.updates, self._values
        table, where, children = analysis.table, analysis.where, analysis.children
        given = table, where, children, analysis.starts, analysis.places, blocks, updates, values
        root = len(table) - 1
        self._end = root if without_root else root + 1

        def run(begin: int, end: int) -> int:
            return eliminate(begin, end, *given, workspace.routines)

        first, second = workspace.halves
        failed = any(both(lambda: run(0, first), lambda: run(first, second))) if first else False
        if failed or run(second, self._end):
            raise Indefinite("the matrix is not positive definite")
        if without_root:
            load_front(root, *given)
        self.root = self._root()

    def _root(self) -> AnyFloats:
        root = self._workspace.analysis.fronts[-1]
        whole = self._values[root.start : root.start + root.width**2]
        return whole.reshape((root.width, root.width), order="F")

    def __del__(self) -> None:
        self._workspace.give_back(self._values)

    @property
    def bytes(self) -> int:
        """Memory of the factor [bytes]."""
        return self._values.nbytes

    def solve(self, b: Floats) -> AnyFloats:
        """Solve for right-hand sides `b`, shape (size, r); the solutions have the same shape.

        The solutions are in the factor's precision.
        """
        count = b.shape[1]
        # BLAS takes longer for three columns than for four, the width of its registers.
        width = count if count < _LANES else -(-count // _LANES) * _LANES
        x = self._forward(b, width)
        self.backward(x)
        return x[:, :count]

    def forward(self, b: Floats) -> AnyFloats:
        """Solve L y = b and return y, shape (size, r).

        If the root is unfactored, its rows hold b minus the contributions of y instead.
        """
        return self._forward(b, b.shape[1])

    def _forward(self, b: Floats, width: int) -> AnyFloats:
        """Return the result of `forward`, with columns of zeros added up to `width` columns."""
        (size, count), (first, second) = b.shape, self._workspace.halves
        analysis = self._workspace.analysis
        # Both threads subtract from the unknowns that the halves share; the second one does so in
        # extra rows behind all others.
        shared = int(analysis.table[second, 0]) if second else size // 3
        x: AnyFloats = np.zeros((2 * size - 3 * shared, width), dtype=self._values.dtype)
        x[:size, :count] = b
        shift = size - 3 * shared

        def run(begin: int, end: int, moved: int = 0) -> None:
            given = analysis.table, analysis.borders, shared, moved, self._values
            substitution.forward(begin, end, *given, x, *self._scratch(width))

        if second:
            both(lambda: run(0, first), lambda: run(first, second, shift))
            x[3 * shared : size] += x[size:]
        run(second, self._end)
        return x[:size]

    def backward(self, x: AnyFloats) -> None:
        """Solve L' z = x (size, r) in place; the rows of an unfactored root must hold z already."""
        analysis, (first, second) = self._workspace.analysis, self._workspace.halves

        def run(begin: int, end: int) -> None:
            given = analysis.table, analysis.borders, self._values, x
            substitution.backward(begin, end, *given, *self._scratch(x.shape[1]))

        run(second, self._end)
        if second:
            both(lambda: run(0, first), lambda: run(first, second))

    def _scratch(self, width: int) -> tuple[AnyFloats, Ints]:
        """Return scratch memory for the border of any front, and the routines of `dense.py`."""
        rows: AnyFloats = np.empty(
            (max(1, self._workspace.scratch_rows), width), self._values.dtype
        )
        return rows, self._workspace.routines
