"""Compressible neo-Hookean rubber, which only an infinite energy could invert.

The energy per volume of the body at rest, with the deformation gradient F and its determinant J, is

    W = mu / 2 (|F|^2 - 3) - mu ln J + lambda / 4 (J^2 - 1 - 2 ln J)        (Ciarlet, Geymonat 1982)

The logarithm is a barrier: W is unbounded as J goes to 0. W is polyconvex, so that equilibria
exist (Ball 1977), and for small strains W gives Hooke's law with the same Lame constants.
`element_loops.py` evaluates W.
"""

from __future__ import annotations

from dataclasses import dataclass

from cohaptic_server.bodies.solid.moduli import Moduli
from cohaptic_server.numeric import Floats


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
        """Returns the material that has these moduli at small strains."""
        return cls(moduli.mu, moduli.lame)
