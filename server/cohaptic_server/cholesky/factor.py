"""A sparse Cholesky factor by fronts, K = L D L': made once, solved for many forces at a time.

The multifrontal method (Duff, Reid 1983; Liu 1992) on the tree of `dissection.py`: each part is a
dense front of its own nodes and the border to its ancestors, so that all arithmetic is LAPACK's.
L has a block for each front, K21 K11^-1 of it, and D the blocks K11, as Cholesky factors: backward
substitution needs L alone, so D is read only where there is a force.

Forces act on the surface only and only the surface is observed. In forward substitution a force
reaches the fronts on its own path to the root; in backward substitution only fronts on the paths to
the observed nodes count. `factorise.py` makes a factor, `factor_file.py` stores it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import scipy.linalg

from cohaptic_server.cholesky.symbolic import dofs
from cohaptic_server.cholesky.values import AnyFloats
from cohaptic_server.numeric import Floats, Ints


@dataclass(frozen=True, eq=False)
class FactorFront:
    """A dense block of the factor.

    Args:
        own: Degrees of freedom eliminated here, shape (a,).
        border: Those of ancestors that they are coupled to, shape (b,).
        lower: Cholesky factor of the own block, shape (a, a).
        carry: Force on the border per force on each own one, K21 K11^-1, shape (b, a).
        parent: Index of the parent; -1 at the root.
        retained: Whether it or a descendant has a retained node; if not, `lower` and `carry` are
            empty.
    """

    own: Ints
    border: Ints
    lower: AnyFloats
    carry: AnyFloats
    parent: int
    retained: bool


class Factor:
    """The Cholesky factor of a symmetric positive definite matrix of 3x3 blocks.

    Args:
        fronts: Children before their parents.
        front_of: Front that eliminates each node, shape (n,).
        numbers: The array in which all blocks lie one after the other, if they do: of each front
            `lower` column by column, then `carry` row by row; shape (k,).

    Attributes:
        fronts: As given.
        front_of: As given.
        numbers: As given.
        size: Number of unknowns, 3 n.
    """

    def __init__(
        self, fronts: Sequence[FactorFront], front_of: Ints, numbers: AnyFloats | None = None
    ) -> None:
        self.fronts, self.front_of, self.numbers = fronts, front_of, numbers
        self.size = 3 * len(front_of)

    @property
    def bytes(self) -> int:
        """Memory of the factor."""
        return sum(front.lower.nbytes + front.carry.nbytes for front in self.fronts)

    def solve(self, nodes: Ints, forces: Floats, at: Ints | None = None) -> AnyFloats:
        """Displacement of the retained nodes under forces on a few of them.

        Args:
            nodes: Retained nodes with a force, shape (k,).
            forces: Forces on them, one column for each load case, shape (3 k, r) [N].
            at: Nodes whose displacement counts, shape (j,); all retained ones if not given. A few
                neighbouring ones cost a fraction of all.

        Returns:
            Shape (3 n, r) [m]; rows of other nodes hold no meaningful values.
        """
        x = np.zeros((self.size, forces.shape[1]), dtype=self.fronts[-1].lower.dtype)
        np.add.at(x, dofs(nodes), forces.astype(x.dtype, copy=False))
        for front in [self.fronts[k] for k in self.path(nodes)]:
            x[front.border] -= front.carry @ x[front.own]
            x[front.own] = scipy.linalg.cho_solve(
                (front.lower, True), x[front.own], check_finite=False
            )
        back = self.fronts if at is None else [self.fronts[k] for k in self.path(at)]
        for front in reversed(back):
            if front.retained and len(front.border):
                x[front.own] -= front.carry.T @ x[front.border]
        return x

    def path(self, nodes: Ints) -> list[int]:
        """Fronts from `nodes` (k,) up to the root, children before parents."""
        path: set[int] = set()
        starts: list[int] = np.unique(self.front_of[nodes]).tolist()
        for k in starts:
            while k >= 0 and k not in path:
                path.add(k)
                k = self.fronts[k].parent
        return sorted(path)


class FactorReader(Protocol):
    """Where a factor is; it can be given to a process that is started."""

    @property
    def bytes(self) -> int:
        """Memory of the factor in single precision."""
        ...

    def read(self) -> Factor:
        """The factor, mapped and not copied.

        Raises:
            BodyError: What is there is no intact factor.
            OSError: It cannot be read.
        """
        ...

    def problem(self) -> str:
        """Why what `read` returned is not to be relied on any more; empty while it is."""
        ...
