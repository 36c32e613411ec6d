"""The Cholesky factor of a matrix whose pattern was analysed before: K = L L', by fronts.

`factor.py` is for a linear solid: factored once, and a tick solves for a few nodes. Here
the matrix is factored in every tick and solved for all unknowns; the analysis of the pattern
(`symbolic.py`), a third to a half of the time of a whole factorisation, is not repeated.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import blas, lapack

from cohaptic.errors import BodyError
from cohaptic_server.cholesky.symbolic import Analysis
from cohaptic_server.numeric import Floats


class Indefinite(BodyError):
    """The matrix is not positive definite: it has no Cholesky factor."""


class Refactored:
    """The factor of a symmetric positive definite matrix.

    Args:
        analysis: Analysis of its pattern.
        entries: Its entries in the order of `analysis.entries`, shape (e,).

    Raises:
        Indefinite: The matrix is not positive definite.
    """

    def __init__(self, analysis: Analysis, entries: Floats) -> None:
        self._analysis = analysis
        self._lower, self._below = list[Floats](), list[Floats]()
        updates: dict[int, Floats] = {}
        for k, front in enumerate(analysis.fronts):
            a, b = len(front.own), len(front.border)
            both, rest = np.zeros((a + b) * a), np.zeros(b * b)
            both[front.targets] = entries[front.entries]
            for child in front.children:
                update = updates.pop(child.front).ravel(order="K")
                both[child.own] += update[child.own_from]
                rest[child.rest] += update[child.rest_from]
            own = both[: a * a].reshape((a, a), order="F")
            lower, failed = lapack.dpotrf(own, lower=1, clean=0, overwrite_a=1)
            if failed:
                raise Indefinite("the matrix is not positive definite")
            below = both[a * a :].reshape((b, a), order="F")
            if b:
                below = blas.dtrsm(1.0, lower, below, side=1, lower=1, trans_a=1, overwrite_b=1)
                c = rest.reshape((b, b), order="F")
                updates[k] = blas.dsyrk(-1.0, below, beta=1.0, c=c, lower=1, overwrite_c=1)
            self._lower.append(lower)
            self._below.append(below)

    @property
    def bytes(self) -> int:
        """Memory of the factor."""
        return sum(block.nbytes for block in self._lower + self._below)

    def solve(self, b: Floats) -> Floats:
        """Solutions, shape (size, r), for right-hand sides `b` (size, r)."""
        x = np.array(b)
        fronts = self._analysis.fronts
        for front, lower, below in zip(fronts, self._lower, self._below, strict=True):
            y = blas.dtrsm(1.0, lower, x[front.own], lower=1)
            x[front.own] = y
            if len(front.border):
                x[front.border] -= below @ y
        for k in reversed(range(len(fronts))):
            front, right = fronts[k], x[fronts[k].own]
            if len(front.border):
                right -= self._below[k].T @ x[front.border]
            x[front.own] = blas.dtrsm(1.0, self._lower[k], right, lower=1, trans_a=1)
        return x
