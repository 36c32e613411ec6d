"""Solves  [K g; g' 0] [u; q] = [b; 0]:  a tangent K at constant volume (g = dV/dx).

K may have one negative mode, which constant volume forbids. The factorisation therefore begins with
all unknowns outside of a cap of vertices (the root of the tree of fronts): K must be positive
definite with the cap held. Next comes the row of the volume, whose pivot is negative, and then the
cap, which must be positive definite again. This succeeds only if K is positive definite on all
motions that keep the volume: a tangent that can be factored is stable. The place of the cap decides
up to which deformation K with the cap held stays positive definite: the last vertices in an order
of narrow band serve better than the vertices on the top, or than a belt.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.linalg import lapack
from scipy.sparse import csgraph

from cohaptic_server.bodies.hyperelastic import IndefiniteTangentError
from cohaptic_server.cholesky.refactor import Indefinite, Refactored, Workspace
from cohaptic_server.numeric import Floats, Ints, Mask


def order_from_base(faces: Ints, free: Mask) -> Ints:
    """Free vertices in an order of narrow band (reverse Cuthill-McKee) that begins at the base.

    Args:
        faces: Vertices of each triangle, shape (m, 3).
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


class ConstantVolumeFactor:
    """A factored tangent at constant volume, as a `TangentSolver`.

    Args:
        workspace: Memory for matrices of K's pattern, with the cap as the root front.
        blocks: Blocks of K in the order of the pattern, shape (e, 9) [N/m].
        g: dV/dx of the unknowns in the order of elimination, shape (size,) [m^2].

    Raises:
        IndefiniteTangentError: K is not positive definite at constant volume.
    """

    def __init__(self, workspace: Workspace, blocks: Floats, g: Floats) -> None:
        try:
            self._factor = Refactored(workspace, blocks, without_root=True)
        except Indefinite as error:
            raise IndefiniteTangentError(
                "the tangent is indefinite even with its cap held"
            ) from error
        self._root = 3 * workspace.analysis.fronts[-1].first
        y = self._factor.forward(g[:, None])
        self._y, self._h = y[: self._root], y[self._root :, 0]
        self._c = float(self._y[:, 0] @ self._y[:, 0])
        S = self._factor.root + np.outer(self._h, self._h) / self._c
        self._R, failed = lapack.dpotrf(S, lower=1)
        if failed:
            raise IndefiniteTangentError("the tangent is indefinite")

    def solve(self, b: Floats) -> tuple[Floats, Floats]:
        """Displacements u (c, size) [m] and multipliers q (c,) [Pa] under `b` (c, size) [N]."""
        x = np.asarray(self._factor.forward(b.T), dtype=np.float64)
        inner, last = x[: self._root], x[self._root :]
        along = self._y[:, 0] @ inner
        rest = last - np.outer(self._h, along / self._c)
        last[:] = lapack.dpotrs(self._R, rest, lower=1)[0]
        q = (along + self._h @ last) / self._c
        inner -= self._y * q
        self._factor.backward(x)
        return np.ascontiguousarray(x.T), np.asarray(q)

    def displacements(self, b: Floats) -> Floats:
        """Displacements of the unknowns, shape (c, size) [m], under forces `b` (c, size) [N]."""
        return self.solve(b)[0]

    def step(self, b: Floats) -> Floats:
        """Returns `displacements`: an approximation would not be quicker to compute."""
        return self.displacements(b)
