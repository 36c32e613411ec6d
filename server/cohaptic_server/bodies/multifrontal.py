"""Sparse Cholesky by fronts: K = L L', factored once, solved for many forces at a time.

The multifrontal method (Duff, Reid 1983; Liu 1992) on the fronts of `fronts.py`, so that all
arithmetic is LAPACK's. Two savings are ours to take, since only the surface is pushed and only the
surface is seen: going up the tree, a force touches the fronts on its own path alone; going down, a
front with no surface under it is left out.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import scipy.sparse as sp
from scipy.linalg import blas, lapack

from cohaptic.errors import BodyError
from cohaptic_server.bodies.fronts import Analysis, Child, analyse, dofs
from cohaptic_server.bodies.mesh import Floats, Ints


class Indefinite(BodyError):
    """A matrix has no Cholesky factor."""


class Factor:
    """The Cholesky factor of a symmetric positive definite matrix of 3x3 blocks.

    Args:
        matrix: Shape (3 n, 3 n).
        points: Place of each node, shape (n, 3) [m].
        wanted: Nodes whose displacement is asked for, shape (n,) of bool.

    Raises:
        Indefinite: The matrix is not positive definite.
    """

    def __init__(self, matrix: sp.csr_array, points: Floats, wanted: npt.NDArray[np.bool_]) -> None:
        analysis = analyse(matrix, points, wanted)
        self._eliminate(analysis, np.asarray(matrix.data[analysis.entries]))

    @classmethod
    def of(cls, analysis: Analysis, entries: Floats) -> Factor:
        """A factor on a pattern known before.

        Args:
            analysis: Of the pattern.
            entries: Of the matrix, in the order of `analysis.entries`, shape (e,).

        Raises:
            Indefinite: The matrix is not positive definite.
        """
        factor = cls.__new__(cls)
        factor._eliminate(analysis, entries)
        return factor

    def _eliminate(self, analysis: Analysis, entries: Floats) -> None:
        self._analysis = analysis
        self.size = 3 * len(analysis.front_of)
        self._lower, self._below = list[Floats](), list[Floats]()
        updates: dict[int, Floats] = {}
        for k, front in enumerate(analysis.fronts):
            a, b = len(front.own), len(front.border)
            both = np.zeros((a + b) * a)
            both[front.places] = entries[front.entries]
            own = both[: a * a].reshape((a, a), order="F")
            below = both[a * a :].reshape((b, a), order="F")
            rest = np.zeros((b, b), order="F")
            for child in front.children:
                update = updates.pop(child.front)
                if child.table is None:
                    _take_in(child, update, own, below, rest)
                else:
                    given = update.ravel(order="K")
                    both[child.table.own] += given[child.table.own_from]
                    rest.ravel(order="K")[child.table.rest] += given[child.table.rest_from]
            lower, failed = lapack.dpotrf(own, lower=1, clean=0, overwrite_a=1)
            if failed:
                raise Indefinite("the stiffness is not positive definite: the object can move")
            if b:
                below = blas.dtrsm(1.0, lower, below, side=1, lower=1, trans_a=1, overwrite_b=1)
                updates[k] = blas.dsyrk(-1.0, below, beta=1.0, c=rest, lower=1, overwrite_c=1)
            self._lower.append(lower)
            self._below.append(below)

    @property
    def bytes(self) -> int:
        """Memory of the factor."""
        return sum(block.nbytes for block in self._lower + self._below)

    def solve(self, nodes: Ints, forces: Floats) -> Floats:
        """Displacement of the wanted nodes under forces on a few nodes.

        Args:
            nodes: With a force, shape (k,).
            forces: On them, one column for each case, shape (3 k, r) [N].

        Returns:
            Shape (3 n, r) [m]; what is not wanted is not filled in.
        """
        x = np.zeros((self.size, forces.shape[1]))
        np.add.at(x, dofs(nodes), forces)
        fronts = self._analysis.fronts
        for k in self._path(nodes):
            front = fronts[k]
            y = blas.dtrsm(1.0, self._lower[k], x[front.own], lower=1)
            x[front.own] = y
            x[front.border] -= self._below[k] @ y
        for front, lower, below in zip(
            reversed(fronts), reversed(self._lower), reversed(self._below), strict=True
        ):
            if front.seen:
                right = x[front.own] - below.T @ x[front.border]
                x[front.own] = blas.dtrsm(1.0, lower, right, lower=1, trans_a=1)
        return x

    def _path(self, nodes: Ints) -> list[int]:
        """Fronts that forces on `nodes` reach, children before parents."""
        found: set[int] = set()
        starts: list[int] = np.unique(self._analysis.front_of[nodes]).tolist()
        for k in starts:
            while k >= 0 and k not in found:
                found.add(k)
                k = self._analysis.fronts[k].parent
        return sorted(found)


def _take_in(child: Child, update: Floats, own: Floats, below: Floats, rest: Floats) -> None:
    """Add a child's update to the blocks of its parent; only lower triangles count."""
    k = len(child.own)
    # Seen as transposed: the blocks lie column by column.
    own.T[np.ix_(child.own, child.own)] += update[:k, :k].T
    below.T[np.ix_(child.own, child.border)] += update[k:, :k].T
    rest.T[np.ix_(child.border, child.border)] += update[k:, k:].T
