"""Stability of the loop between a local model and a slow, distant simulation.

Three ways to judge stability must agree, and are tested against each other: the paper's closed
conditions (8), (10), (15), (16) with their delayed forms (science 3.1); the lifted system of eqs.
(1)-(6) for any local model and any object, with delay in haptic samples; and the conditions for
several contacts under any delay (3.2, 3.3). All functions here are pure.

The stable set of (K_h, I N T) of the integral model is given in closed form and by the lifted
system. Eq. (15) allows K_h beyond K_o, up to 3 K_o, where a large enough I stabilises a K_h that
would be unstable alone: for such a K_h there is also a least I N T.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.optimize import minimize_scalar

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
    """The paper's proportional law L(z) = K_h, at the haptic rate."""
    return StateSpace(np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0)), np.array([[k_h]]))


def integral_model(k_h: float, integral_gain: float, haptic_period: float) -> StateSpace:
    """The paper's integral law L(z) = K_h + T I / (z - 1), eq. (12), at the haptic rate."""
    one = np.ones((1, 1))
    return StateSpace(one, haptic_period * integral_gain * one, one, k_h * one)


def elastic_object(k_o: float, b_o: float = 0.0) -> StateSpace:
    """The object D(z) = (K_o + B_o (z - 1) / z)^-1, eqs. (6) and (9), one simulation period late.

    The force f at tick k gives the position x+ at tick k + 1: (K_o + B_o) x+ = f + B_o x.

    Args:
        k_o: Local stiffness [N/m].
        b_o: Local damping over the simulation period [N/m].
    """
    one = np.ones((1, 1))
    return StateSpace(b_o / (k_o + b_o) * one, one / (k_o + b_o), one, 0.0 * one)


def proportional_is_stable(k_h: float, k_o: float, b_o: float = 0.0) -> bool:
    """Whether eq. (8) holds, or (10) with damping, without delay.

    Without damping the condition holds for every delay (3.1).
    """
    return k_h < k_o + 2.0 * b_o


def integral_is_stable(
    k_h: float, integral_gain: float, k_o: float, simulation_period: float, b_o: float = 0.0
) -> bool:
    """Whether eq. (15) holds, or (16) with damping, both without delay.

    Both equations assume K_h, I > 0; (16) as printed lacks the T of I N T.
    """
    int_ = integral_gain * simulation_period
    return abs(int_ - k_h + b_o) < k_o + b_o and int_ - 2.0 * k_h > -2.0 * k_o - 4.0 * b_o


def lifted_radius(
    local: StateSpace, body: StateSpace, rate_ratio: int, delay_samples: int = 0
) -> float:
    """Spectral radius of the loop over one simulation period; stable iff < 1.

    The force at the first haptic sample of a period goes to the object. The local model sees the
    object's answer one simulation period and `delay_samples` haptic samples later and holds that
    answer until the next one (eqs. (1)-(6); with delay, the surface in use changes within a
    period). Only the sum of the delays on the way up and down matters: a shift of the local model's
    clock moves one delay into the other.

    Args:
        local: Local model at the haptic rate, from penetration x_h - x_o to force.
        body: Object at the simulation rate, from force to its next position.
        rate_ratio: N, haptic samples per simulation period.
        delay_samples: Round trip beyond the one period of computation, in haptic samples.
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
    # State: local model, object, positions on their way (the newest first).
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
    """Largest modulus of an eigenvalue; 0 for an empty matrix."""
    return float(np.abs(np.linalg.eigvals(M)).max()) if M.size else 0.0


_SCAN = 48  # values of I N T that are tried before the bisection
_BISECTIONS = 24  # final width 2^-24 of a scan step, the accuracy of a 32-bit number


def closed_edges(k_h: Floats, k_o: float, b_o: float = 0.0) -> tuple[Floats, Floats]:
    """Least and largest stable I N T by eqs. (15) and (16), without delay; nan if none is stable.

    Args:
        k_h: Shape (n,) [N/m].
        k_o: Local stiffness [N/m].
        b_o: Local damping over the simulation period [N/m].

    Returns:
        Two arrays of shape (n,) [N/m].
    """
    low = np.maximum(0.0, np.maximum(k_h - k_o - 2.0 * b_o, 2.0 * k_h - 2.0 * k_o - 4.0 * b_o))
    high = k_h + k_o
    some = low < high
    return np.where(some, low, np.nan), np.where(some, high, np.nan)


def lifted_edges(
    k_h: Floats, k_o: float, b_o: float = 0.0, *, rate_ratio: int = 1, delay_samples: int = 0
) -> tuple[Floats, Floats]:
    """Least and largest stable I N T by bisection on the lifted system, for any delay.

    With whole simulation periods of delay the result depends on I N T but not on the rate ratio; a
    ratio of 1 is quickest.
    """
    body = elastic_object(k_o, b_o)

    edges: list[tuple[float, float]] = []
    for k in k_h.tolist():

        def radius(int_: float, k: float = k) -> float:
            local = integral_model(k, int_, 1.0 / rate_ratio)
            return lifted_radius(local, body, rate_ratio, delay_samples)

        edges.append(_interval(radius, 1e-6 * k_o, k + k_o))
    table = np.array(edges)
    return table[:, 0], table[:, 1]


def stability_area(
    k_o: float,
    b_o: float = 0.0,
    *,
    rate_ratio: int = 1,
    delay_samples: int = 0,
    points: int = 121,
) -> Floats:
    """The stable set of (K_h, I N T) as a polygon to draw, as in Fig. 8.

    The polygon goes up along the largest I N T of each K_h and back along the least; the first
    point is repeated at the end.

    Args:
        k_o: Local stiffness [N/m].
        b_o: Local damping over the simulation period [N/m].
        rate_ratio: N; 1 is enough for delays of whole simulation periods.
        delay_samples: Round trip beyond the one period of computation, in haptic samples.
        points: Number of values of K_h.

    Returns:
        Rows (K_h, I N T), shape (m, 2) [N/m].
    """
    k_h = np.linspace(1e-3 * k_o, 3.0 * k_o + 4.0 * b_o, points)
    low, high = lifted_edges(k_h, k_o, b_o, rate_ratio=rate_ratio, delay_samples=delay_samples)
    some = ~np.isnan(low)
    up = np.stack([k_h[some], high[some]], axis=1)
    back = np.stack([k_h[some], low[some]], axis=1)[::-1]
    return np.concatenate([up, back, up[:1]])


def _interval(radius: Callable[[float], float], first: float, last: float) -> tuple[float, float]:
    """Interval of I N T in which `radius` < 1, from 0 if `first` is stable; nan if none is."""
    tried = np.linspace(first, last, _SCAN).tolist()
    radii = [radius(x) for x in tried]
    step = tried[1] - tried[0]
    stable = [x for x, r in zip(tried, radii, strict=True) if r < 1.0]
    if not stable:
        # Near its corner the set is thinner than a scan step: search for the least radius.
        best = tried[int(np.argmin(radii))]
        least = minimize_scalar(radius, bounds=(best - step, best + step), method="bounded")
        if least.fun >= 1.0:
            return np.nan, np.nan
        stable = [float(least.x)]
    low = 0.0 if stable[0] == first else _bisect(radius, stable[0], stable[0] - step)
    return low, _bisect(radius, stable[-1], stable[-1] + step)


def _bisect(radius: Callable[[float], float], good: float, bad: float) -> float:
    """Edge of stability between a stable and an unstable I N T."""
    for _ in range(_BISECTIONS):
        middle = 0.5 * (good + bad)
        good, bad = (middle, bad) if radius(middle) < 1.0 else (good, middle)
    return good
