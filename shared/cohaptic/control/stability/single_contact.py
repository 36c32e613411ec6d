"""Stability of the loop between a local model and a slow, distant simulation.

Three ways to judge stability must agree, and tests compare them: the paper's closed conditions (8),
(10), (15), (16) with their delayed forms (science 3.1); the lifted system of eqs. (1)-(6) for any
local model and any object, with delay in haptic samples; and the conditions for several contacts
under any delay (3.2, 3.3). All functions here are pure.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class StateSpace:
    """A discrete linear system with one input u and one output y.

    The output is y = C s + D u, and the next state is A s + B u for the present state s.

    Args:
        A: Shape (n, n).
        B: Shape (n, 1).
        C: Shape (1, n).
        D: Shape (1, 1).
    """

    A: Floats
    B: Floats
    C: Floats
    D: Floats


def proportional_model(k_h: float) -> StateSpace:
    """Return the paper's proportional law L(z) = K_h as a system at the haptic rate."""
    return StateSpace(np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0)), np.array([[k_h]]))


def integral_model(k_h: float, integral_gain: float, haptic_period: float) -> StateSpace:
    """Return the paper's integral law L(z) = K_h + T I / (z - 1), eq. (12), at the haptic rate.

    Args:
        k_h: Gain K_h [N/m].
        integral_gain: Integral gain I [N/(m s)].
        haptic_period: Haptic period T [s].
    """
    one = np.ones((1, 1))
    return StateSpace(one, haptic_period * integral_gain * one, one, k_h * one)


def elastic_object(k_o: float, b_o: float = 0.0) -> StateSpace:
    """Return the object D(z) = (K_o + B_o (z - 1) / z)^-1 as a system at the simulation rate.

    The system is that of eqs. (6) and (9), one simulation period late: the force f at tick k gives
    the position x+ at tick k + 1, (K_o + B_o) x+ = f + B_o x, from the position x at tick k.

    Args:
        k_o: Local stiffness K_o [N/m].
        b_o: Local damping divided by the simulation period, B_o [N/m].
    """
    one = np.ones((1, 1))
    return StateSpace(b_o / (k_o + b_o) * one, one / (k_o + b_o), one, 0.0 * one)


def proportional_is_stable(k_h: float, k_o: float, b_o: float = 0.0) -> bool:
    """Return whether the proportional law is stable by eq. (8), or with damping by eq. (10).

    The conditions assume no delay beyond one simulation period; eq. (8) is the same for every delay
    (science 3.1).

    Args:
        k_h: Gain [N/m].
        k_o: Local stiffness [N/m].
        b_o: Local damping divided by the simulation period [N/m].
    """
    return k_h < k_o + 2.0 * b_o


def integral_is_stable(
    k_h: float, integral_gain: float, k_o: float, simulation_period: float, b_o: float = 0.0
) -> bool:
    """Return whether the integral law is stable by eq. (15), or with damping by eq. (16).

    The conditions assume no delay beyond one simulation period, and K_h, I > 0. Eq. (16) as printed
    lacks the T of I N T.

    Args:
        k_h: Gain K_h [N/m].
        integral_gain: Integral gain I [N/(m s)].
        k_o: Local stiffness [N/m].
        simulation_period: Simulation period N T [s].
        b_o: Local damping divided by the simulation period [N/m].
    """
    int_ = integral_gain * simulation_period
    return abs(int_ - k_h + b_o) < k_o + b_o and int_ - 2.0 * k_h > -2.0 * k_o - 4.0 * b_o


def lifted_radius(
    local: StateSpace, body: StateSpace, rate_ratio: int, delay_samples: int = 0
) -> float:
    """Return the loop's spectral radius over one simulation period; the loop is stable iff < 1.

    The force at the first haptic sample of a period goes to the object. The local model sees the
    object's answer one simulation period and `delay_samples` haptic samples later and holds that
    answer until the next one (eqs. (1)-(6); with delay, the surface in use changes within a
    period). Only the sum of the delays to and from the server matters: a shift of the local model's
    clock moves one delay into the other.

    Args:
        local: Local model at the haptic rate, from penetration x_h - x_o to force.
        body: Object at the simulation rate, from force to its next position.
        rate_ratio: Haptic samples per simulation period, N.
        delay_samples: Round trip beyond one simulation period, in haptic samples.
    """
    whole, part = divmod(delay_samples, rate_ratio)
    # The first `part` samples of a period use an older position, the others the newer one.
    power = [np.linalg.matrix_power(local.A, i) for i in range(rate_ratio)]
    early = sum((power[rate_ratio - 1 - i] @ local.B for i in range(part)), np.zeros_like(local.B))
    late = sum(
        (power[rate_ratio - 1 - i] @ local.B for i in range(part, rate_ratio)),
        np.zeros_like(local.B),
    )
    n, m, slots = len(local.A), len(body.A), whole + 1 + (part > 0)
    # State: local model, object, positions in the delay line (the newest first).
    M = np.zeros((n + m + slots, n + m + slots))
    oldest, newer = n + m + slots - 1, n + m + whole
    M[:n, :n] = np.linalg.matrix_power(local.A, rate_ratio)
    M[:n, newer] -= late[:, 0]
    M[:n, oldest] -= early[:, 0]
    first = oldest if part else newer
    force = np.zeros(n + m + slots)
    force[:n] = local.C[0]
    force[first] -= local.D[0, 0]
    M[n : n + m] = body.B @ force[None, :]
    M[n : n + m, n : n + m] += body.A
    # The position that follows from this period's force enters the delay line.
    M[n + m] = body.C[0] @ M[n : n + m]
    for k in range(1, slots):
        M[n + m + k, n + m + k - 1] = 1.0
    return spectral_radius(M)


def spectral_radius(M: Floats) -> float:
    """Return the largest modulus of a matrix's eigenvalues; 0 for an empty matrix."""
    return float(np.abs(np.linalg.eigvals(M)).max()) if M.size else 0.0
