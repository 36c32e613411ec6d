"""Elastic moduli of each element of a solid, which has one material or several."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cohaptic.errors import BodyError
from cohaptic_server.numeric import Floats, Ints

# Largest ratio of the stiffest part's modulus to the softest part's. A factor in double precision
# loses as many digits as this ratio has; beyond it, fewer than the ten digits that columns and
# presses need would be left.
MAX_CONTRAST = 1e6


@dataclass(frozen=True, eq=False)
class Moduli:
    """Young's modulus and Poisson's ratio of each tetrahedron.

    Args:
        young: Young's modulus E, shape (m,) [Pa].
        nu: Poisson's ratio, shape (m,).

    Raises:
        BodyError: The shapes do not fit, or the stiffest element is too stiff for the softest one.
    """

    young: Floats
    nu: Floats

    def __post_init__(self) -> None:
        if self.young.ndim != 1 or self.young.shape != self.nu.shape or not len(self.young):
            raise BodyError(f"moduli of {self.young.shape} and {self.nu.shape} elements")
        low, high = float(self.young.min()), float(self.young.max())
        if not high <= MAX_CONTRAST * low:
            raise BodyError(
                f"the stiffest part has {high:g} Pa and the softest one {low:g} Pa: beyond a ratio"
                f" of {MAX_CONTRAST:g} the solution has too few digits"
            )

    @classmethod
    def uniform(cls, count: int, young: float, nu: float) -> Moduli:
        """Returns the moduli of `count` elements of one material."""
        return cls(np.full(count, young), np.full(count, nu))

    @property
    def is_uniform(self) -> bool:
        """Whether all elements have the same material."""
        same = self.young.min() == self.young.max() and self.nu.min() == self.nu.max()
        return bool(same)

    @property
    def lame(self) -> Floats:
        """Lame's first constant lambda, shape (m,) [Pa]."""
        return np.asarray(self.young * self.nu / ((1.0 + self.nu) * (1.0 - 2.0 * self.nu)))

    @property
    def mu(self) -> Floats:
        """Shear modulus, Lame's second constant, shape (m,) [Pa]."""
        return np.asarray(self.young / (2.0 * (1.0 + self.nu)))

    def of_elements(self, elements: Ints) -> Moduli:
        """Moduli of some elements (k,); an element that was split may occur several times."""
        return Moduli(self.young[elements], self.nu[elements])
