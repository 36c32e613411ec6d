"""Stability of several users on one object, whose contacts share the compliance matrix C.

Each law is a fixed-point iteration of the forces on each other through the body, f <- K (x_h - M f)
with M = C for the paper's laws and M = C off its diagonal for the predictive one (science 3.2,
3.3). Without delay it converges iff rho(K M) < 1; under any bounded delays, different for each user
and varying in time, iff rho(K |M|) < 1 (Chazan and Miranker 1969). An integral makes the loop
depend on its delays: `sampled_room.py` takes them one by one.

The paper's laws get gains below that. The predictive law keeps K_i = 1 / C_ii with any number of
others, and where the delays do not allow that the room's lag makes it stable (science 3.8).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cohaptic.control.gains import ALPHA, choose_gains
from cohaptic.control.law import Gains, Law
from cohaptic.control.stability.lag_choice import coupling_matrix, coupling_radius, lag_needed
from cohaptic.control.stability.sampled_room import loop_matrix, room_radius
from cohaptic.control.stability.single_contact import Floats, spectral_radius
from cohaptic.errors import SettingError


@dataclass(frozen=True, slots=True)
class Coupling:
    """Stability of several users with given gains, and the gains that are safe.

    Args:
        rho_no_delay: Spectral radius over one simulation period without further delay; stable iff
            < 1.
        rho_any_delay: Of the absolute values; stable under any bounded delays iff < 1. None with an
            integral: no such bound holds for one.
        safe_k_h: Gains that `gains.choose_gains` takes: from the row rule; with the predictive law
            1 / C_ii, with the room's lag [N/m].
        safe_integral_gain: Same, for the integral [N/(m s)].
        felt_stiffness: Stiffness that each hand feels alone with its safe gain; with the pi law in
            the steady state [N/m].
        stiffness_loss: Its relative loss against K_o,i = 1 / C_ii, 0 to 1.
        coupling: m of science 3.8 with the safe gains; below 1 they need no lag at any constant
            delays. None for the paper's laws, which have no lag.
        lag_needed: Above this lag the room with the safe gains is stable [s]; None likewise.
    """

    rho_no_delay: float
    rho_any_delay: float | None
    safe_k_h: tuple[float, ...]
    safe_integral_gain: tuple[float, ...]
    felt_stiffness: tuple[float, ...]
    stiffness_loss: tuple[float, ...]
    coupling: float | None
    lag_needed: float | None


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


def couple(
    C: Floats,
    k_h: Floats,
    law: Law,
    *,
    integral_gain: float = 0.0,
    simulation_period: float = 1.0 / 60.0,
    delay: float = 0.0,
    max_stiffness: float = 1e6,
) -> Coupling:
    """Judge gains, and find safe ones.

    Args:
        C: Contact compliance, shape (n, n) [m/N].
        k_h: Gains to be judged, shape (n,) [N/m].
        law: Local model of everybody.
        integral_gain: I of everybody, to be judged with k_h [N/(m s)]; 0 for the predictive law.
        simulation_period: N T [s].
        delay: Network round trip, for the safe gains and the lag [s].
        max_stiffness: Of the devices [N/m].

    Raises:
        SettingError: C, k_h or the integral gain is outside its limits.
    """
    check_compliance(C)
    if law is Law.PREDICTIVE and integral_gain > 0.0:
        limit = "0 with the predictive law, which has no integral"
        raise SettingError("integral_gain", integral_gain, limit)
    n = len(C)
    if k_h.shape != (n,) or not (np.isfinite(k_h) & (k_h >= 0.0)).all():
        raise SettingError("k_h", k_h.tolist(), f"{n} gains of at least 0 N/m")
    safe = _safe_gains(C, law, simulation_period, delay, max_stiffness)
    no_delay = np.ones(n, dtype=np.int64)
    gains = [Gains(k, integral_gain) for k in k_h.tolist()]
    m = None
    if law is Law.PREDICTIVE:
        m = coupling_radius(coupling_matrix(C, [np.array([[g.k_h]]) for g in safe]))
    # One period from a force to the surface that answers it, one for the client's ramp to it.
    longest_delay = delay + 2.0 * simulation_period
    return Coupling(
        rho_no_delay=room_radius(C, gains, law, no_delay, simulation_period),
        rho_any_delay=(
            None
            if integral_gain > 0.0
            else spectral_radius(k_h[:, None] * np.abs(loop_matrix(C, law)))
        ),
        safe_k_h=tuple(g.k_h for g in safe),
        safe_integral_gain=tuple(g.integral_gain for g in safe),
        felt_stiffness=(felt := tuple(_felt(g, C[i, i], law) for i, g in enumerate(safe))),
        stiffness_loss=tuple(float(1.0 - f * C[i, i]) for i, f in enumerate(felt)),
        coupling=m,
        lag_needed=None if m is None else lag_needed(m, longest_delay),
    )


def _safe_gains(
    C: Floats, law: Law, simulation_period: float, delay: float, max_stiffness: float
) -> list[Gains]:
    """Gains that the server would choose for each user; arguments as in `couple`."""
    return [
        choose_gains(
            law,
            row,
            i,
            max_stiffness=max_stiffness,
            loop_delay=simulation_period + delay,
            simulation_period=simulation_period,
        )
        for i, row in enumerate(C.tolist())
    ]


def _felt(gains: Gains, c_ii: float, law: Law) -> float:
    """Stiffness that one hand feels alone [N/m]."""
    if law is Law.PREDICTIVE:
        return float(gains.k_h)
    if law is Law.PI:
        return float(1.0 / c_ii)
    return float(gains.k_h / (1.0 + gains.k_h * c_ii))  # eq. (11)


def largest_uniform_gains(C: Floats, law: Law, *, alpha: float = ALPHA) -> Floats:
    """Largest safe gains that keep the users' shares equal: K_i = s / C_ii with one s.

    Safe without a lag, at any bounded delays. Never smaller for all than the row rule, since rho is
    at most the largest row sum; the row rule needs only a client's own row.

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
