"""Compressible neo-Hookean rubber: no finite energy inverts it.

Per volume of the body at rest, with F the deformation gradient and J its determinant,

    W = mu / 2 (|F|^2 - 3) - mu ln J + lambda / 4 (J^2 - 1 - 2 ln J)        (Ciarlet, Geymonat 1982)

The logarithm is a barrier: W has no bound as J goes to 0. W is polyconvex, so that equilibria
exist (Ball 1977), and for small strains it is Hooke's law with the same Lame constants.
`element_loops.py` evaluates it.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class NeoHookean:
    """A compressible neo-Hookean material.

    Args:
        mu: Shear modulus, Lame's second constant [Pa].
        lame: Lame's first constant [Pa].
    """

    mu: float
    lame: float

    @classmethod
    def of(cls, young: float, nu: float) -> NeoHookean:
        """The material with Young's modulus [Pa] and Poisson's ratio at small strains."""
        return cls(young / (2.0 * (1.0 + nu)), young * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)))
