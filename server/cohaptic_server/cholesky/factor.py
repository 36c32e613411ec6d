"""A sparse Cholesky factor K = L D L' of a stiffness matrix K, computed once for many solves.

The method is multifrontal (Duff, Reid 1983; Liu 1992) on the tree of `symbolic.py`: each part of
the mesh becomes a dense front over its own unknowns (index 1) and its border (index 2), so that
LAPACK does all arithmetic. L contains the block K21 K11^-1 of each front, and D contains the blocks
K11 as Cholesky factors. Backward substitution needs L alone, so D is read only in fronts that a
force reaches.

Forces act on the surface only, and only its displacement is needed. In forward substitution a force
reaches the fronts on its own path to the root; in backward substitution only fronts on the paths to
the wanted nodes count. `factorise.py` makes a factor, `factor_file.py` stores it.
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
    """The part of a factor that belongs to one front.

    Args:
        own: Degrees of freedom that are eliminated in this front, shape (a,).
        border: Degrees of freedom of ancestors to which the own ones are coupled, shape (b,).
        lower: Cholesky factor of the own block, shape (a, a).
        carry: Block K21 K11^-1 of L: force that each own degree of freedom passes to the border,
            per unit of force on it, shape (b, a).
        parent: Index of the parent front; -1 at the root.
        retained: Whether the front or a descendant has a retained node; if not, `lower` and `carry`
            are empty.
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
        fronts: Fronts, children before their parents.
        front_of: Front that eliminates each node, shape (n,).
        numbers: Array in which all blocks lie one after the other, `lower` of each front column by
            column, then `carry` row by row, shape (k,); None if the blocks are separate arrays.
        multiple: The matrix over the one that the fronts are a factor of. A solid of another
            Young's modulus has the same fronts.

    Attributes:
        size: Number of unknowns, 3 n.
    """

    def __init__(
        self,
        fronts: Sequence[FactorFront],
        front_of: Ints,
        numbers: AnyFloats | None = None,
        multiple: float = 1.0,
    ) -> None:
        self.fronts, self.front_of, self.numbers = fronts, front_of, numbers
        self.multiple = multiple
        self.size = 3 * len(front_of)

    def times(self, multiple: float) -> Factor:
        """Return the factor of a multiple of the matrix, with the same fronts."""
        return Factor(self.fronts, self.front_of, self.numbers, multiple * self.multiple)

    @property
    def bytes(self) -> int:
        """Memory of the factor's blocks [bytes]."""
        return sum(front.lower.nbytes + front.carry.nbytes for front in self.fronts)

    def solve(self, nodes: Ints, forces: Floats, at: Ints | None = None) -> AnyFloats:
        """Solve for the displacement of the retained nodes under forces on a few of them.

        Args:
            nodes: Retained nodes with a force, shape (k,).
            forces: Forces on these nodes, one column for each load case, shape (3 k, r) [N].
            at: Nodes whose displacement is needed, shape (j,); None for all retained nodes. A
                solve for a few neighbouring nodes takes a fraction of the time.

        Returns:
            Displacement, shape (3 n, r) [m]; rows of other nodes hold no meaningful values.
        """
        x = np.zeros((self.size, forces.shape[1]), dtype=self.fronts[-1].lower.dtype)
        np.add.at(x, dofs(nodes), (forces / self.multiple).astype(x.dtype, copy=False))
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
        """Return the fronts of `nodes` (k,) and all their ancestors, children before parents."""
        path: set[int] = set()
        starts: list[int] = np.unique(self.front_of[nodes]).tolist()
        for k in starts:
            while k >= 0 and k not in path:
                path.add(k)
                k = self.fronts[k].parent
        return sorted(path)


class FactorReader(Protocol):
    """A stored factor that a new process can read."""

    @property
    def bytes(self) -> int:
        """Memory of the factor in single precision [bytes]."""
        ...

    def read(self) -> Factor:
        """Return the factor; its numbers are mapped into memory and not copied.

        Raises:
            BodyError: The stored data are not an intact factor.
            OSError: The factor cannot be read.
        """
        ...

    def problem(self) -> str:
        """Return why the factor from `read` can no longer be relied on; empty if it still can."""
        ...
