"""When several users on one object are stable: what their contacts share is C.

Each law is a fixed-point iteration of the forces on each other through the body, f <- K (x_h - M f)
with M = C for the proportional law and M = C off its diagonal for the predictive one (science 3.2,
3.3). Without delay it converges iff rho(K M) < 1; under any bounded delays, different for each user
and varying in time, iff rho(K |M|) < 1 (Chazan and Miranker 1969).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cohaptic.control.gains import ALPHA, choose_gain
from cohaptic.control.law import Law
from cohaptic.control.stability import Floats, spectral_radius
from cohaptic.errors import SettingError


@dataclass(frozen=True, slots=True)
class Coupling:
    """Stability of several users with given gains, and the gains that are safe.

    Args:
        rho_no_delay: Spectral radius without delay; stable iff < 1.
        rho_any_delay: Of the absolute values; stable under any bounded delays iff < 1.
        safe_k_h: Gains that are safe under any delay, from the row rule [N/m].
        felt_stiffness: What each hand feels alone with its safe gain, in steady state [N/m].
        stiffness_loss: Its loss against K_o,i = 1 / C_ii, 0 to 1.
    """

    rho_no_delay: float
    rho_any_delay: float
    safe_k_h: tuple[float, ...]
    felt_stiffness: tuple[float, ...]
    stiffness_loss: tuple[float, ...]


def check_compliance(C: Floats) -> None:
    """Raise SettingError unless C is a square, symmetric, positive definite matrix of numbers."""
    if C.ndim != 2 or C.shape[0] != C.shape[1] or C.size == 0:
        raise SettingError("compliance", f"of shape {C.shape}", "a square matrix [m/N]")
    if not np.isfinite(C).all():
        raise SettingError("compliance", "not finite", "a matrix of finite numbers [m/N]")
    if np.abs(C - C.T).max() > 1e-6 * np.abs(C).max():
        raise SettingError("compliance", "not symmetric", "symmetric (Maxwell-Betti)")
    least = float(np.linalg.eigvalsh(0.5 * (C + C.T)).min())
    if least <= 0.0:
        limit = "positive definite: an elastic body stores energy"
        raise SettingError("least eigenvalue of the compliance", f"{least:.3g} m/N", limit)


def loop_matrix(C: Floats, law: Law) -> Floats:
    """M of the iteration f <- K (x_h - M f), shape (n, n) [m/N]."""
    return C if law is Law.PROPORTIONAL else C - np.diag(np.diag(C))


def couple(C: Floats, k_h: Floats, law: Law, *, max_stiffness: float = 1e6) -> Coupling:
    """Judge gains, and find safe ones.

    Args:
        C: Contact compliance, shape (n, n) [m/N].
        k_h: Gains to be judged, shape (n,) [N/m].
        law: Local model of everybody.
        max_stiffness: Of the devices [N/m].

    Raises:
        SettingError: C or k_h is not what it must be.
    """
    check_compliance(C)
    if k_h.shape != (len(C),) or not (np.isfinite(k_h) & (k_h >= 0.0)).all():
        raise SettingError("k_h", k_h.tolist(), f"{len(C)} gains of at least 0 N/m")
    M = loop_matrix(C, law)
    safe = [
        choose_gain(law, row, i, max_stiffness=max_stiffness) for i, row in enumerate(C.tolist())
    ]
    felt = [k if law is Law.PREDICTIVE else k / (1.0 + k * C[i, i]) for i, k in enumerate(safe)]
    return Coupling(
        rho_no_delay=spectral_radius(k_h[:, None] * M),
        rho_any_delay=spectral_radius(k_h[:, None] * np.abs(M)),
        safe_k_h=tuple(safe),
        felt_stiffness=tuple(float(f) for f in felt),
        stiffness_loss=tuple(float(1.0 - f * C[i, i]) for i, f in enumerate(felt)),
    )


def largest_uniform_gains(C: Floats, law: Law, *, alpha: float = ALPHA) -> Floats:
    """Largest safe gains that keep the users' shares equal: K_i = s / C_ii with one s.

    Never smaller for all than the row rule, since rho is at most the largest row sum; the row rule
    needs only a client's own row.

    Args:
        C: Shape (n, n) [m/N].
        law: Local model of everybody.
        alpha: Margin, < 1.

    Returns:
        Shape (n,) [N/m].
    """
    check_compliance(C)
    k_o = 1.0 / np.diag(C)
    radius = spectral_radius(k_o[:, None] * np.abs(loop_matrix(C, law)))
    return np.asarray(k_o * min(1.0, alpha / radius if radius > 0.0 else 1.0))
