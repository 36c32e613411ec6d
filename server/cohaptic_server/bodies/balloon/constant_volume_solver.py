"""Solves  [K g; g' 0] [u; q] = [b; 0]:  a tangent K, and water that cannot leave (g = dV/dx).

Banded Cholesky, as LAPACK does it in a third of the time of a sparse LU on a surface of a few
hundred vertices (docs/decisions/0014). The unknowns run from the held base to the far side. K may
have one negative mode, the one that the water forbids; so the band is factored up to a last cap,
which is positive definite as the cap holds it, then the water's row, whose pivot is negative, then
the cap, which must be positive definite again. This succeeds only if K is positive definite on all
motions that keep the volume: a factored tangent is a stable one.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import scipy.sparse as sp
from scipy.linalg import blas, lapack
from scipy.sparse import csgraph

from cohaptic_server.bodies.newton import Unstable
from cohaptic_server.numeric import Floats, Ints


def order(faces: Ints, free: npt.NDArray[np.bool_]) -> Ints:
    """Vertices that are free, in an order of narrow band that begins beside the held ones.

    Args:
        faces: Shape (m, 3).
        free: Shape (n,).
    """
    n = len(free)
    pairs = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    graph = sp.csr_array((np.ones(len(pairs)), pairs.T), shape=(n, n))
    graph = sp.csr_array(graph + graph.T)[free][:, free]
    found = np.asarray(
        csgraph.reverse_cuthill_mckee(sp.csr_matrix(graph), symmetric_mode=True), dtype=np.int64
    )
    beside = np.isin(np.flatnonzero(free), faces[~free[faces].all(axis=1)])
    if np.flatnonzero(beside[found]).mean() > 0.5 * len(found):
        found = found[::-1]
    return np.asarray(np.flatnonzero(free)[found], dtype=np.int64)


class Band:
    """The pattern of a symmetric banded matrix, and which entry goes where.

    Args:
        rows: Of the entries of the lower triangle, shape (e,).
        columns: Shape (e,); nowhere greater than `rows`.
        size: Number of unknowns.
        share: Of the unknowns that are factored after the water, at most a half.

    Attributes:
        width: Greatest distance of an entry from the diagonal.
        cap: First unknown of those that are factored last.
        near: How many unknowns before the cap it can be tied to.
    """

    def __init__(self, rows: Ints, columns: Ints, size: int, share: float = 0.14) -> None:
        self.size = size
        self.width = int((rows - columns).max())
        last = min(max(self.width, round(share * size)), size // 2)
        self.cap = cap = size - last
        self.near = near = min(self.width, cap)
        self._in_band = np.flatnonzero(rows < cap)
        self._in_ties = np.flatnonzero((rows >= cap) & (columns < cap))
        self._in_cap = np.flatnonzero(columns >= cap)
        row, column = rows[self._in_band], columns[self._in_band]
        self._band = row - column + column * (self.width + 1)
        self._ties = (columns[self._in_ties] - (cap - near)) * last + rows[self._in_ties] - cap
        self._cap = (rows[self._in_cap] - cap) * last + columns[self._in_cap] - cap
        # The last `near` columns of the band as a triangle.
        low = np.tril_indices(near)
        self.triangle = low
        self.of_band = (low[0] - low[1], cap - near + low[1])

    def split(self, entries: Floats) -> tuple[Floats, Floats, Floats]:
        """LAPACK's band before the cap, the ties (near, last) and the cap's lower triangle."""
        last = self.size - self.cap
        band = np.zeros((self.width + 1) * self.cap)
        ties, cap = np.zeros(self.near * last), np.zeros(last * last)
        band[self._band] = entries[self._in_band]
        ties[self._ties] = entries[self._in_ties]
        cap[self._cap] = entries[self._in_cap]
        return (
            band.reshape((self.width + 1, self.cap), order="F"),
            ties.reshape(self.near, last),
            cap.reshape(last, last),
        )


class HeldWater:
    """A factored tangent.

    Args:
        band: Its pattern.
        entries: Of the lower triangle of K, in the pattern's order, shape (e,) [N/m].
        g: dV/dx of the unknowns, shape (size,) [m^2].

    Raises:
        Unstable: K is not positive definite where the water lets the body move.
    """

    def __init__(self, band: Band, entries: Floats, g: Floats) -> None:
        self._band = band
        cap, near = band.cap, band.near
        leading, ties, last = band.split(entries)
        self._L, failed = lapack.dpbtrf(leading, lower=1, overwrite_ab=1)
        if failed:
            raise Unstable("the tangent is indefinite even with its cap held")
        corner = np.zeros((near, near), order="F")
        corner[band.triangle] = self._L[band.of_band]
        self._W = blas.dtrsm(1.0, corner, ties, lower=1)  # (near, last)
        self._y = self._forward(g[:cap])
        self._c = float(self._y @ self._y)
        self._h = g[cap:] - self._y[cap - near :] @ self._W
        S = last - self._W.T @ self._W + np.outer(self._h, self._h) / self._c
        self._R, failed = lapack.dpotrf(S, lower=1)
        if failed:
            raise Unstable("the tangent is indefinite")

    def _forward(self, b: Floats) -> Floats:
        return np.asarray(blas.dtbsv(self._band.width, self._L, b, lower=1))

    def solve(self, b: Floats) -> tuple[Floats, Floats]:
        """Displacements u, shape (c, size) [m], and q, shape (c,) [Pa], under `b` (c, size) [N]."""
        cap, near, width = self._band.cap, self._band.near, self._band.width
        u, q = np.empty_like(b), np.empty(len(b))
        for i, right in enumerate(b):
            y = self._forward(right[:cap])
            along = float(self._y @ y)
            rest = right[cap:] - y[cap - near :] @ self._W - self._h * (along / self._c)
            u2, _ = lapack.dpotrs(self._R, rest, lower=1)
            q[i] = (along + float(self._h @ u2)) / self._c
            y = y - q[i] * self._y
            y[cap - near :] -= self._W @ u2
            u[i, :cap] = blas.dtbsv(width, self._L, y, lower=1, trans=1)
            u[i, cap:] = u2
        return u, q

    def displacements(self, b: Floats) -> Floats:
        """Of the unknowns alone, shape (c, size) [m]."""
        return self.solve(b)[0]
