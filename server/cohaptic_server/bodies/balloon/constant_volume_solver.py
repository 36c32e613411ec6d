"""Solves  [K g; g' 0] [u; q] = [b; 0]:  a tangent K at constant volume (g = dV/dx).

Banded Cholesky, as LAPACK does it in a third of the time of a sparse LU on a surface of a few
hundred vertices (docs/decisions/0014). The unknowns run from the fixed base to the far side. K may
have one negative mode, which constant volume forbids. The band is therefore factored up to a last
cap, which is positive definite with the cap fixed; then the row of the volume, whose pivot is
negative; then the cap, which must be positive definite again. This
succeeds only if K is positive definite on all motions that keep the volume: a factored tangent is a
stable one.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.linalg import blas, lapack
from scipy.sparse import csgraph

from cohaptic_server.bodies.hyperelastic import IndefiniteTangentError
from cohaptic_server.numeric import Floats, Ints, Mask


def narrow_band_order(faces: Ints, free: Mask) -> Ints:
    """Free vertices in an order of narrow band that begins beside the fixed ones.

    Args:
        faces: Shape (m, 3).
        free: Vertices that can move, shape (n,).

    Returns:
        Indices of the free vertices, shape (f,).
    """
    n = len(free)
    pairs = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    graph = sp.csr_array((np.ones(len(pairs)), pairs.T), shape=(n, n))
    graph = sp.csr_array(graph + graph.T)[free][:, free]
    order = np.asarray(
        csgraph.reverse_cuthill_mckee(sp.csr_matrix(graph), symmetric_mode=True), dtype=np.int64
    )
    beside = np.isin(np.flatnonzero(free), faces[~free[faces].all(axis=1)])
    if np.flatnonzero(beside[order]).mean() > 0.5 * len(order):
        order = order[::-1]
    return np.asarray(np.flatnonzero(free)[order], dtype=np.int64)


class BandPattern:
    """The pattern of a symmetric banded matrix and the position of each entry in its blocks.

    Args:
        rows: Rows of the entries of the lower triangle, shape (e,).
        columns: Their columns, nowhere greater than `rows`, shape (e,).
        size: Number of unknowns.
        share: Share of the unknowns in the cap, at most a half.

    Attributes:
        width: Largest distance of an entry from the diagonal.
        cap: First unknown of the cap, which is factored after the volume's row.
        near: Number of unknowns before the cap that can be coupled to it.
    """

    def __init__(self, rows: Ints, columns: Ints, size: int, share: float = 0.14) -> None:
        self.size = size
        self.width = int((rows - columns).max())
        last = min(max(self.width, round(share * size)), size // 2)
        self.cap = cap = size - last
        self.near = near = min(self.width, cap)
        self._in_band = np.flatnonzero(rows < cap)
        self._in_coupling = np.flatnonzero((rows >= cap) & (columns < cap))
        self._in_cap = np.flatnonzero(columns >= cap)
        row, column = rows[self._in_band], columns[self._in_band]
        self._band = row - column + column * (self.width + 1)
        self._coupling = (
            (columns[self._in_coupling] - (cap - near)) * last + rows[self._in_coupling] - cap
        )
        self._cap = (rows[self._in_cap] - cap) * last + columns[self._in_cap] - cap
        # The last `near` columns of the band as a triangle.
        low = np.tril_indices(near)
        self.triangle = low
        self.of_band = (low[0] - low[1], cap - near + low[1])

    def split(self, entries: Floats) -> tuple[Floats, Floats, Floats]:
        """LAPACK's band before the cap, the coupling (near, last) and the cap's lower triangle."""
        last = self.size - self.cap
        band = np.zeros((self.width + 1) * self.cap)
        coupling, cap = np.zeros(self.near * last), np.zeros(last * last)
        band[self._band] = entries[self._in_band]
        coupling[self._coupling] = entries[self._in_coupling]
        cap[self._cap] = entries[self._in_cap]
        return (
            band.reshape((self.width + 1, self.cap), order="F"),
            coupling.reshape(self.near, last),
            cap.reshape(last, last),
        )


class ConstantVolumeFactor:
    """A factored tangent at constant volume: a `TangentSolver`.

    Args:
        band: Pattern of K.
        entries: Lower triangle of K, in the pattern's order, shape (e,) [N/m].
        g: dV/dx of the unknowns, shape (size,) [m^2].

    Raises:
        IndefiniteTangentError: K is not positive definite at constant volume.
    """

    def __init__(self, band: BandPattern, entries: Floats, g: Floats) -> None:
        self._band = band
        cap, near = band.cap, band.near
        leading, coupling, last = band.split(entries)
        self._L, failed = lapack.dpbtrf(leading, lower=1, overwrite_ab=1)
        if failed:
            raise IndefiniteTangentError("the tangent is indefinite even with its cap held")
        corner = np.zeros((near, near), order="F")
        corner[band.triangle] = self._L[band.of_band]
        self._W = blas.dtrsm(1.0, corner, coupling, lower=1)  # (near, last)
        self._y = self._forward(g[:cap])
        self._c = float(self._y @ self._y)
        self._h = g[cap:] - self._y[cap - near :] @ self._W
        S = last - self._W.T @ self._W + np.outer(self._h, self._h) / self._c
        self._R, failed = lapack.dpotrf(S, lower=1)
        if failed:
            raise IndefiniteTangentError("the tangent is indefinite")

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
        """Displacements of the unknowns, shape (c, size) [m], under forces `b` (c, size) [N]."""
        return self.solve(b)[0]
