"""The gain of the loop between hands, for given hands and models of them (science 3.15)."""

from __future__ import annotations

import numpy as np

from cohaptic_server.numeric import Complex, Floats
from cohaptic_server.world.partners.small_gain import contacts, impedance

_ALIASES = 5  # beyond which T has fallen with 1 / f^2, and the lines by another 1 / f^2


def loops(C: Floats, hands: Floats, models: Floats, frequencies: Floats) -> Complex:
    """Return T of hands that are taken for models, shape (..., f, n, n); arguments as above."""
    A = contacts(C, models, frequencies)
    E = np.moveaxis(
        1.0 / impedance(hands, frequencies) - 1.0 / impedance(models, frequencies), -1, -2
    )
    own = np.diagonal(A, axis1=-2, axis2=-1)
    T = -(E / (1.0 + E * own))[..., None] * A
    return np.asarray(T * (1.0 - np.eye(C.shape[-1])))


def radius(T: Complex) -> Floats:
    """Return the spectral radius of |T| (..., n, n), shape (...)."""
    return np.asarray(np.abs(np.linalg.eigvals(np.abs(T))).max(axis=-1))


def sampled_radius(
    C: Floats, hands: Floats, models: Floats, tick: float, points: int = 60
) -> Floats:
    """Return the largest spectral radius with q sampled in ticks and joined by lines, shape (...).

    What comes back at w of samples is the sum over m of T(w + 2 pi m / tick), each with the gain
    sinc^2 of lines between samples; science 3.15.

    Args:
        C: Compliance, shape (..., n, n) [m/N].
        hands: Shape (..., n, 3).
        models: Shape (..., n, 3).
        tick: Period of the ticks [s].
        points: Number of frequencies between 0 and half of the rate of the ticks.
    """
    base = (np.arange(points) + 0.5) / points * 0.5 / tick
    total: Floats = np.zeros((*C.shape[:-2], points, C.shape[-1], C.shape[-1]))
    for m in range(-_ALIASES, _ALIASES + 1):
        f = base + m / tick
        total = total + np.abs(loops(C, hands, models, f)) * np.sinc(f * tick)[:, None, None] ** 2
    return np.asarray(np.abs(np.linalg.eigvals(total)).max(axis=-1).max(axis=-1))
