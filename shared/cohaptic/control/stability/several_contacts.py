"""Stability of several users on one object, whose contacts share the compliance matrix C.

Each law is a fixed-point iteration in which the forces f act on each other through the body,
f <- K (x_h - M f), with the gains K, the probes' positions x_h, M = C for the paper's laws and
M = C without its diagonal for the predictive law (science 3.2, 3.3). Without delay the iteration
converges iff rho(K M) < 1; under any bounded delays, different for each user and varying in time,
iff rho(K |M|) < 1 (Chazan and Miranker 1969). With an integral, stability depends on the delays,
which the sampled room models one by one.

The server chooses gains below that bound for the paper's laws. For the predictive law it chooses
K_i = 1 / C_ii with any number of other users; if these gains are not stable at the delays, the
room's lag makes them stable (science 3.8).

In the sampled room of `room_radius` clients send forces once in a simulation period, and each loop
delay is a whole number of periods. The model is exact for any gains, with the paper's integral and
with the room's lag (science 3.8), stepped as on the server. `room_roots.py` is the counterpart in
continuous time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cohaptic.control.gains import ALPHA, choose_gains
from cohaptic.control.law import Law
from cohaptic.control.laws.model import Gains
from cohaptic.control.stability.lag_choice import coupling_matrix, coupling_radius, kept, lag_needed
from cohaptic.control.stability.single_contact import Floats, spectral_radius
from cohaptic.errors import SettingError


@dataclass(frozen=True, slots=True)
class Coupling:
    """Stability of several users with the gains under test, and the gains that are safe.

    Args:
        rho_no_delay: Spectral radius over one simulation period without further delay; stable iff
            < 1.
        rho_any_delay: Spectral radius rho(K |M|) with the gains K and `loop_matrix` M; stable under
            any bounded delays iff < 1. None with an integral, for which no such bound holds.
        safe_k_h: Gains that `gains.choose_gains` chooses: by the row rule (`coupled_stiffness`), or
            1 / C_ii for the predictive law, which relies on the room's lag [N/m].
        safe_integral_gain: Integral gains that `gains.choose_gains` chooses [N/(m s)].
        felt_stiffness: Stiffness that each hand feels with its safe gain if no other hand touches,
            for the pi law in the steady state [N/m].
        stiffness_loss: Relative loss of that stiffness against the object's, 1 / C_ii; 0 to 1.
        coupling: Coupling m of science 3.8 with the safe gains; below 1 the room needs no lag at
            any constant delays. None for the paper's laws, which have no lag.
        lag_needed: Lag above which the room with the safe gains is stable [s]; None for the paper's
            laws.
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
    """Raise SettingError unless C is a finite, square, symmetric, positive definite matrix."""
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
    """Judge the stability of several users with the gains `k_h`, and choose safe gains for them.

    Args:
        C: Compliance matrix of the contacts, shape (n, n) [m/N].
        k_h: Gains to be judged, shape (n,) [N/m].
        law: Local model of all users.
        integral_gain: Integral gain I of all users, to be judged with k_h [N/(m s)]; 0 for the
            predictive law.
        simulation_period: Simulation period N T [s].
        delay: Network round trip, for the safe gains and the lag [s].
        max_stiffness: Largest stiffness of the devices [N/m].

    Raises:
        SettingError: C, k_h or the integral gain is outside its limits.
    """
    check_compliance(C)
    if integral_gain > 0.0 and not law.answers_own_dent:
        limit = f"0 with the {law.value} law, which has no integral"
        raise SettingError("integral_gain", integral_gain, limit)
    n = len(C)
    if k_h.shape != (n,) or not (np.isfinite(k_h) & (k_h >= 0.0)).all():
        raise SettingError("k_h", k_h.tolist(), f"{n} gains of at least 0 N/m")
    safe = _safe_gains(C, law, simulation_period, delay, max_stiffness)
    own: list[float] = np.diag(C).tolist()
    no_delay = np.ones(n, dtype=np.int64)
    gains = [Gains(k, integral_gain) for k in k_h.tolist()]
    m = None
    if not law.answers_own_dent:
        m = coupling_radius(coupling_matrix(C, [np.array([[g.k_h]]) for g in safe]))
    felt = tuple(law.model.felt_stiffness(g.k_h, 1.0 / c) for g, c in zip(safe, own, strict=True))
    # One period from a force to the surface that answers it, and one for the client's ramp.
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
        felt_stiffness=felt,
        stiffness_loss=tuple(1.0 - f * c for f, c in zip(felt, own, strict=True)),
        coupling=m,
        lag_needed=None if m is None else lag_needed(m, longest_delay),
    )


def _safe_gains(
    C: Floats, law: Law, simulation_period: float, delay: float, max_stiffness: float
) -> list[Gains]:
    """Return the gains that the server would choose for each user; arguments as for `couple`."""
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


def largest_uniform_gains(C: Floats, law: Law, *, alpha: float = ALPHA) -> Floats:
    """Return the largest safe gains that are the same fraction s of each contact's stiffness.

    The gains K_i = s / C_ii are safe without a lag, at any bounded delays. s is at least the
    smallest K_i C_ii of the row rule (`coupled_stiffness`), since a spectral radius is at
    most the largest row sum; the row rule, however, needs only a client's own row of C.

    Args:
        C: Compliance matrix of the contacts, shape (n, n) [m/N].
        law: Local model of all users.
        alpha: Ratio of the gains to the edge of stability, < 1.

    Returns:
        Gains, shape (n,) [N/m].
    """
    check_compliance(C)
    k_o = 1.0 / np.diag(C)
    radius = spectral_radius(k_o[:, None] * np.abs(loop_matrix(C, law)))
    return np.asarray(k_o * min(1.0, alpha / radius if radius > 0.0 else 1.0))


Ints = npt.NDArray[np.int64]


def loop_matrix(C: Floats, law: Law) -> Floats:
    """Return M of the iteration f <- K (x_h - M f) for forces f and gains K, shape (n, n) [m/N].

    M is C for the paper's laws. It is C without its diagonal for the predictive law, whose surface
    does not include the dent of the hand's own force.

    Args:
        C: Compliance matrix of the contacts, shape (n, n) [m/N].
        law: Local model of all users.
    """
    return C if law.answers_own_dent else C - np.diag(np.diag(C))


def room_radius(
    C: Floats,
    gains: Sequence[Gains],
    law: Law,
    delays: Ints,
    simulation_period: float,
    lag: float = 0.0,
) -> float:
    """Return the spectral radius of a sampled room over one simulation period; stable iff < 1.

    At tick k user i receives the body's response to all users' forces of tick k - delays[i]. Only
    the round trip of each user matters: the delay from user j to user i is up_j + down_i, and a
    change of variables moves up_j into the loop of user j.

    Args:
        C: Compliance matrix of the contacts, shape (n, n) [m/N].
        gains: Gains of each user.
        law: Local model of all users.
        delays: Loop delay of each user in simulation periods, at least 1, shape (n,).
        simulation_period: Simulation period N T [s].
        lag: Lag of the room, through which every force enters the body; 0 for none [s].
    """
    n, longest = len(C), int(delays.max())
    M = loop_matrix(C, law)
    k_h = np.array([g.k_h for g in gains])
    # A law that does not answer its own dent has no integral, whatever the gains are.
    integrals = simulation_period if law.answers_own_dent else 0.0
    rate = np.array([g.integral_gain for g in gains]) * integrals
    # State: the integrals, then all users' forces behind the lag for the last `longest` ticks.
    A = np.zeros((n * (longest + 1),) * 2)
    seen = np.zeros((n, len(A)))  # depth of each probe, held still, below its surface
    for i in range(n):
        seen[i, n * delays[i] : n * (delays[i] + 1)] = -M[i]
    own = np.zeros((n, len(A)))
    own[:, :n] = np.eye(n)
    A[:n] = own + rate[:, None] * seen
    A[np.flatnonzero(rate == 0.0)] = 0.0  # without a gain the integral stays at zero
    old = kept(lag, simulation_period)
    A[n : 2 * n] = (1.0 - old) * (k_h[:, None] * seen + own)
    A[n : 2 * n, n : 2 * n] += old * np.eye(n)
    for age in range(2, longest + 1):
        A[n * age : n * (age + 1), n * (age - 1) : n * age] = np.eye(n)
    if not rate.any():
        return spectral_radius(A[n:, n:])
    return spectral_radius(A)
