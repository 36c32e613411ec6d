"""Hyperelastic bodies: their interface to the Newton iteration, and the material of rubber.

`newton.py` uses the interface; `balloon/rubber_balloon.py` and `rubber_solid/rubber_tetrahedra.py`
implement it.

The rubber is compressible and neo-Hookean, and only an infinite energy could invert it. The energy
W per volume of the body at rest, with the deformation gradient F, its determinant J, and Lame's
constants lambda and mu, is

    W = mu / 2 (|F|^2 - 3) - mu ln J + lambda / 4 (J^2 - 1 - 2 ln J)        (Ciarlet, Geymonat 1982)

The logarithm is a barrier: W is unbounded as J goes to 0. W is polyconvex, so that equilibria
exist (Ball 1977), and for small strains W gives Hooke's law with the same Lame constants.
`element_loops.py` evaluates W.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, TypeVar

from cohaptic.errors import BodyError
from cohaptic_server.bodies.solid.shape import Moduli
from cohaptic_server.numeric import Floats, Ints


class IndefiniteTangentError(BodyError):
    """The tangent is not positive definite on the displacements that the body allows."""


class DeformedState(Protocol):
    """A deformed body, not necessarily in equilibrium."""

    @property
    def x(self) -> Floats:
        """Positions of the nodes, shape (n, 3) [m]."""
        ...

    @property
    def energy(self) -> float:
        """Stored energy [J]."""
        ...


class TangentSolver(Protocol):
    """A factored tangent stiffness."""

    def displacements(self, b: Floats) -> Floats:
        """Solve for the displacements of the unknowns under forces on them.

        Args:
            b: Forces in c load cases, shape (c, size) [N].

        Returns:
            Displacements, shape (c, size) [m].
        """
        ...

    def step(self, b: Floats) -> Floats:
        """Solve as `displacements` does, only as exactly as a step of Newton's method needs."""
        ...


S = TypeVar("S", bound=DeformedState)


class Hyperelastic(Protocol[S]):
    """A body with a stored energy E(x), from which residual forces and tangent stiffness follow."""

    @property
    def dof(self) -> Ints:
        """Indices of the unknowns among the 3 n coordinates, in solver order, shape (size,)."""
        ...

    @property
    def stiffenings(self) -> tuple[float, ...]:
        """Rising amounts of stiffening that make an indefinite tangent positive definite."""
        ...

    def displaced(self, state: S, step: Floats, external: Floats) -> S | None:
        """Return the state after a step, with the body's constraints satisfied.

        Args:
            state: State before the step.
            step: Displacement of the nodes, shape (n, 3) [m].
            external: Nodal forces of the contacts, shape (n, 3) [N].

        Returns:
            The new state; None if the body allows no state at the new positions.
        """
        ...

    def residual(self, state: S, external: Floats) -> Floats:
        """Return the external forces less the internal forces, shape (n, 3) [N]."""
        ...

    def factor_tangent(
        self, state: S, stiffening: float, b: Floats
    ) -> tuple[TangentSolver, Floats]:
        """Factor the tangent stiffness, and solve with the factor.

        Args:
            state: The deformed body.
            stiffening: Amount of stiffening, 0 for the exact tangent.
            b: Forces on the unknowns, shape (c, size) [N].

        Returns:
            The factor, and the displacements of the unknowns under `b`, shape (c, size) [m].

        Raises:
            IndefiniteTangentError: The tangent is not positive definite.
        """
        ...


def total_energy(state: DeformedState, external: Floats) -> float:
    """Return the potential energy of a body under dead loads, E(x) - external . x [J].

    Args:
        state: The deformed body, with its stored energy E and its positions x.
        external: Nodal forces of the contacts, shape (n, 3) [N].
    """
    return state.energy - float((external * state.x).sum())


@dataclass(frozen=True, slots=True)
class NeoHookean:
    """A compressible neo-Hookean material for each element.

    Args:
        mu: Shear modulus, Lame's second constant, shape (m,) [Pa].
        lame: Lame's first constant, shape (m,) [Pa].
    """

    mu: Floats
    lame: Floats

    @classmethod
    def of(cls, moduli: Moduli) -> NeoHookean:
        """Return the material that has these moduli at small strains."""
        return cls(moduli.mu, moduli.lame)
