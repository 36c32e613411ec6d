"""Compressible neo-Hookean rubber: no finite energy inverts it.

Per volume of the body at rest, with F the deformation gradient and J its determinant,

    W = mu / 2 (|F|^2 - 3) - mu ln J + lambda / 4 (J^2 - 1 - 2 ln J)        (Ciarlet, Geymonat 1982)

The logarithm is a barrier: W has no bound as J goes to 0. W is polyconvex, so that equilibria
exist (Ball 1977), and for small strains it is Hooke's law with the same Lame constants.

With h the gradients of the shape functions in the present state, the tangent of an element is

    K_ai,bj = mu (g_a . g_b) d_ij + lambda J^2 h_ai h_bj + (mu - lambda / 2 (J^2 - 1)) h_aj h_bi

and only the last term, s tr(L L) of a gradient L of velocity, can make it indefinite: by the spin
in L where s > 0, by the strain in it where s < 0. A stiffened tangent removes that part. Arrays
have the quadrature points last.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cohaptic_server.numeric import Floats


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

    def energy_density(self, state: SolidStrain) -> Floats:
        """W, shape (q,) [J/m^3]."""
        squares = np.einsum("ipq,ipq->q", state.F, state.F)
        log, J = np.log(state.J), state.J
        return np.asarray(
            self.mu * (0.5 * (squares - 3.0) - log)
            + 0.25 * self.lame * ((J - 1.0) * (J + 1.0) - 2.0 * log)
        )

    def stress(self, state: SolidStrain) -> Floats:
        """First Piola-Kirchhoff stress dW/dF, shape (3, 3, q) [Pa]."""
        return np.asarray(
            self.mu * state.F - self.transpose_modulus(state) * state.inverse.swapaxes(0, 1)
        )

    def volumetric_modulus(self, state: SolidStrain) -> Floats:
        """Modulus of h_ai h_bj, the change of volume: lambda J^2, shape (q,) [Pa]."""
        return np.asarray(self.lame * state.J * state.J)

    def transpose_modulus(self, state: SolidStrain) -> Floats:
        """Modulus s of h_aj h_bi, which can make the tangent indefinite, shape (q,) [Pa]."""
        return np.asarray(self.mu - 0.5 * self.lame * (state.J - 1.0) * (state.J + 1.0))


@dataclass(frozen=True, eq=False)
class SolidStrain:
    """The strain at quadrature points.

    Args:
        F: Deformation gradient dx_i/dX_p, shape (3, 3, q).
        inverse: Of F, dX_p/dx_i, shape (3, 3, q).
        J: Determinant of F; positive, shape (q,).
    """

    F: Floats
    inverse: Floats
    J: Floats


def solid_strain(F: Floats, least: Floats | float) -> SolidStrain | None:
    """The strain of deformation gradients.

    Args:
        F: Shape (3, 3, q).
        least: Lower bound of J, one for all points or one for each, shape (q,).

    Returns:
        None where J is not above `least`.
    """
    cofactor = np.empty_like(F)
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        for p in range(3):
            q, r = (p + 1) % 3, (p + 2) % 3
            cofactor[i, p] = F[j, q] * F[k, r] - F[j, r] * F[k, q]
    J = np.asarray(F[0, 0] * cofactor[0, 0] + F[0, 1] * cofactor[0, 1] + F[0, 2] * cofactor[0, 2])
    # Written as a negation, so that NaN is refused too.
    if not (least < J).all():
        return None
    return SolidStrain(F, np.asarray(cofactor.swapaxes(0, 1) / J), J)
