"""A factor in single precision whose solutions are as accurate as those in double precision.

Single precision halves the time and the memory of a factor. The errors of its solutions, 1e-6 to
1e-4, are removed by conjugate gradients with the factor as preconditioner, mostly in one iteration
(Wilkinson 1963; Buttari and others 2008).

A matrix that rounding alone makes positive definite must not be accepted. Conjugate gradients
detect such a matrix: along some direction its curvature is not positive, or the iteration does not
converge, as the preconditioner is far from the inverse. The matrix is then factored in double
precision.
"""

from __future__ import annotations

import numpy as np

from cohaptic_server.cholesky.blocks import multiply
from cohaptic_server.cholesky.refactor import Indefinite, Refactored, Workspace
from cohaptic_server.cholesky.symbolic import Analysis
from cohaptic_server.numeric import Floats

# Error in the energy norm, relative to the solution, at which one more correction by the factor
# leaves the square of this error or less.
_CLOSE = 1e-4
_ITERATIONS = 5


class Workspaces:
    """The memory in which matrices of one pattern are factored, in both precisions.

    Args:
        analysis: Analysis of the pattern.
    """

    def __init__(self, analysis: Analysis) -> None:
        self.single, self.double = Workspace(analysis, single=True), Workspace(analysis)


class Refined:
    """The factor of a symmetric positive definite matrix, in single precision while that suffices.

    Args:
        workspaces: Memory for matrices of the same pattern.
        blocks: Blocks of the matrix in the order of `analysis.rows`, shape (e, 9) [N/m].

    Raises:
        Indefinite: The matrix is not positive definite.
    """

    def __init__(self, workspaces: Workspaces, blocks: Floats) -> None:
        self._workspaces, self._matrix = workspaces, blocks
        self._double: Refactored | None = None
        try:
            self._factor = Refactored(workspaces.single, blocks)
        except Indefinite:
            # Rounding alone may have made the matrix indefinite.
            self._factor = self._double = Refactored(workspaces.double, blocks)

    def checked(self, b: Floats) -> Floats:
        """Solve for right-hand sides `b`, shape (size, r), as accurately as in double precision.

        Returns:
            Solutions, shape (size, r).

        Raises:
            Indefinite: The matrix turns out not to be positive definite.
        """
        found = None if self._double else self._conjugate_gradients(b)
        if found is None:
            self._double = self._double or Refactored(self._workspaces.double, self._matrix)
            found = np.asarray(self._double.solve(b), dtype=np.float64)
        return found

    def solve(self, b: Floats) -> Floats:
        """Return the solutions of `checked`, or of `approximate` if the matrix is indefinite."""
        try:
            return self.checked(b)
        except Indefinite:
            return self.approximate(b)

    def approximate(self, b: Floats) -> Floats:
        """Return the solutions of one pass through the factor, in half of the time of `checked`.

        The solutions have the errors of single precision unless the factor is in double precision.
        """
        size = _norms(b)
        return np.asarray(self._factor.solve(b / size) * size, dtype=np.float64)

    def _conjugate_gradients(self, b: Floats) -> Floats | None:
        """Return solutions; None if a column does not converge or a curvature is not positive."""
        analysis, factor = self._workspaces.single.analysis, self._factor
        size = _norms(b)
        r = b / size
        x, moved = np.zeros_like(b), np.empty_like(b)
        z = np.asarray(factor.solve(r), dtype=np.float64)
        p, rz = z, np.einsum("ic,ic->c", r, z)
        enough = _CLOSE * _CLOSE * rz
        for _ in range(_ITERATIONS):
            multiply(self._matrix, analysis.starts, analysis.rows, p, moved)
            curvature = np.einsum("ic,ic->c", p, moved)
            if not (curvature[rz > 0.0] > 0.0).all():
                return None
            length = rz / np.where(curvature > 0.0, curvature, 1.0)
            x += length * p
            r -= length * moved
            z = np.asarray(factor.solve(r), dtype=np.float64)
            last, rz = rz, np.einsum("ic,ic->c", r, z)
            if (rz <= enough).all():
                return np.asarray((x + z) * size)
            p = z + rz / np.where(last > 0.0, last, 1.0) * p
        return None


def _norms(b: Floats) -> Floats:
    """Return the norm of each column, or 1 for a zero column, to scale it to single precision."""
    size = np.sqrt(np.einsum("ic,ic->c", b, b))
    return np.where(size > 0.0, size, 1.0)
