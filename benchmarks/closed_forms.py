"""Closed solutions of linear elasticity for a fingertip's pressure: a beam, a layer, a plate.

A fingertip presses with p = 2 F / (pi a^2) (1 - r^2 / a^2) (`mesh/search/pressure_search.py`), and
the compliance is the displacement along the force, averaged over that pressure, per newton.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.integrate import cumulative_trapezoid, trapezoid
from scipy.special import gamma, jv

from cohaptic_server.numeric import Floats

SHEAR = 5.0 / 6.0  # shear coefficient of a rectangular section, and of a plate (Reissner 1945)
_WAVES = 4000.0  # largest wavenumber times contact radius; the integrands fall as its square
_STEPS = 400_000
_TERMS = 4  # of the pressure under a rigid punch; three more change the sixth digit


@dataclass(frozen=True, slots=True)
class Hooke:
    """An isotropic elastic material.

    Args:
        young: Young's modulus E [Pa].
        nu: Poisson's ratio.
    """

    young: float
    nu: float

    @property
    def shear(self) -> float:
        """Shear modulus [Pa]."""
        return self.young / (2.0 * (1.0 + self.nu))


def cantilever(material: Hooke, length: float, side: float) -> float:
    """Compliance of a square beam at a distance from its clamp [m/N] (Timoshenko 1921).

    Args:
        material: Material of the beam.
        length: From the clamp to the force [m].
        side: Side of its section [m].
    """
    bending = length**3 / (3.0 * material.young * side**4 / 12.0)
    return bending + length / (SHEAR * material.shear * side**2)


def clamped_plate(material: Hooke, radius: float, thickness: float, contact: float) -> float:
    """Compliance of a clamped circular plate under a fingertip in its middle [m/N].

    Mindlin's plate theory, in which bending and shear add up where the shear force is known from
    equilibrium: D (1/r (r w')')' = Q in bending and w' = -Q / (k G t) in shear.

    Args:
        material: Material of the plate.
        radius: Radius of the clamp [m].
        thickness: Thickness of the plate [m].
        contact: Radius of the pressure [m].
    """
    D = material.young * thickness**3 / (12.0 * (1.0 - material.nu**2))
    r = np.concatenate([[0.0], np.geomspace(1e-6 * contact, radius, 200_000)])
    part = np.minimum(r / contact, 1.0) ** 2
    Q = np.zeros_like(r)
    Q[1:] = (2.0 * part[1:] - part[1:] ** 2) / (2.0 * math.pi * r[1:])
    # r w' of the bending part; its homogeneous solution, r^2, makes w' = 0 at the clamp.
    turned = _running(_running(Q, r) * r / D, r)
    slope = np.zeros_like(r)
    slope[1:] = turned[1:] / r[1:] - turned[-1] * r[1:] / radius**2
    fall = _running(Q / (SHEAR * material.shear * thickness) - slope, r)
    w = fall[-1] - fall
    pressure = 4.0 / contact**2 * np.maximum(0.0, 1.0 - (r / contact) ** 2) * r
    return float(trapezoid(pressure * w, r))


def layer(material: Hooke, thickness: float, contact: float) -> float:
    """Compliance of a layer on a rigid base that it sticks to, under a fingertip [m/N].

    Args:
        material: Material of the layer.
        thickness: Thickness of the layer [m]; infinity for a half space.
        contact: Radius of the pressure [m].
    """
    return float(_mutual(material, thickness, contact, [_profile(1.0)])[0, 0])


def punch(material: Hooke, thickness: float, contact: float) -> float:
    """Stiffness of such a layer under a flat rigid punch without friction [N/m].

    The pressure is a sum of (1 - r^2 / a^2)^(k - 1/2) that makes the depth the same all over:
    the first term alone is Boussinesq's on a half space, where the stiffness is 2 a E / (1 - nu^2).

    Args:
        material: Material of the layer.
        thickness: Thickness of the layer [m]; infinity for a half space.
        contact: Radius of the punch [m].
    """
    C = _mutual(material, thickness, contact, [_profile(k - 0.5) for k in range(_TERMS)])
    return float(np.linalg.solve(C, np.ones(_TERMS)).sum())


def _waves() -> Floats:
    # Half a step from zero, where the functions of it are 0 / 0.
    return np.asarray((np.arange(_STEPS) + 0.5) * (_WAVES / _STEPS), dtype=np.float64)


def _profile(power: float) -> Floats:
    """Hankel transform of a pressure (1 - r^2 / a^2)^power of 1 N, at the wavenumbers / a."""
    k = _waves()
    waves = np.asarray(jv(power + 1.0, k), dtype=np.float64)
    factor = float(gamma(power + 2.0)) * (2.0 / k) ** (power + 1.0)
    return np.asarray(factor * waves, dtype=np.float64)


def _mutual(material: Hooke, thickness: float, contact: float, profiles: list[Floats]) -> Floats:
    """Mean displacement in each pressure for 1 N in each other one [m/N].

    w(k) = 2 (1 - nu^2) / (E k) G(k h) p(k), with G = 1 for a half space and for a bonded layer
    G = (2 c sinh 2x - 4 x) / (2 c cosh 2x + 4 x^2 + 1 + c^2), c = 3 - 4 nu (Burmister 1945).
    """
    k = _waves()
    G = np.ones_like(k)
    if math.isfinite(thickness):
        c = 3.0 - 4.0 * material.nu
        x = np.minimum(k * thickness / contact, 300.0)  # where G is 1 and cosh is finite
        G = (2.0 * c * np.sinh(2.0 * x) - 4.0 * x) / (
            2.0 * c * np.cosh(2.0 * x) + 4.0 * x**2 + 1.0 + c**2
        )
    table = np.array([[np.sum(p * q * G) for q in profiles] for p in profiles])
    step = _WAVES / _STEPS
    scale = step * (1.0 - material.nu**2) / (math.pi * material.young * contact)
    return np.asarray(scale * table, dtype=np.float64)


def _running(y: Floats, x: Floats) -> Floats:
    return np.concatenate([[0.0], np.asarray(cumulative_trapezoid(y, x))])
