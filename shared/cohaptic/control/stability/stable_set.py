"""The stable set of (K_h, I N T) of the integral model, in closed form and by the lifted system.

Eq. (15) allows K_h beyond K_o, up to 3 K_o, where a large enough I stabilises a K_h that would be
unstable alone: for such a K_h there is also a least I N T.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import minimize_scalar

from cohaptic.control.stability.single_contact import (
    Floats,
    elastic_object,
    integral_model,
    lifted_radius,
)

# Values of I N T that are tried before the bisection: a set that is thinner than the step between
# two of them is searched for by its least radius.
_SCAN = 48
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
