"""The Cholesky factor of a matrix whose pattern was analysed before: K = L L', by fronts.

`multifrontal.py` has the factor of a linear solid, made once, from which a tick asks for a little.
Here the factor is made in every tick and solved for all unknowns: nothing is found out again that
the pattern decides (`fronts.py`), which takes a third to a half of the time.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import blas, lapack

from cohaptic.errors import BodyError
from cohaptic_server.cholesky.symbolic import Analysis
from cohaptic_server.numeric import Floats


class Indefinite(BodyError):
    """A matrix is not positive definite: it has no Cholesky factor."""


class Refactored:
    """A symmetric positive definite matrix, factored.

    Args:
        analysis: Of its pattern.
        entries: In the order of `analysis.entries`, shape (e,).

    Raises:
        Indefinite: It is not positive definite.
    """

    def __init__(self, analysis: Analysis, entries: Floats) -> None:
        self._analysis = analysis
        self._lower, self._below = list[Floats](), list[Floats]()
        updates: dict[int, Floats] = {}
        for k, front in enumerate(analysis.fronts):
            a, b = len(front.own), len(front.border)
            both, rest = np.zeros((a + b) * a), np.zeros(b * b)
            both[front.places] = entries[front.entries]
            for child in front.children:
                given = updates.pop(child.front).ravel(order="K")
                both[child.own] += given[child.own_from]
                rest[child.rest] += given[child.rest_from]
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
