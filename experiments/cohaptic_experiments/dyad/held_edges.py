"""Least lag of a room of held hands: by its roots, by the small gain theorem, by the theorem.

Beside science 3.8, whose edge needs the spectral radius and the longest delay alone, stand the
exact edge by the rightmost root, and a delay-dependent criterion for all delays up to the given
ones: the small gain theorem about the loop without delay (Gu, Kharitonov and Chen 2003, Stability
of Time-Delay Systems, chapter 3). With R(s) = (I (1 + s tau) + S)^-1, stable since I + S is
positive definite, and |e^(-i w T) - 1| <= eta(w T), where eta(x) = 2 sin(x / 2) up to pi and 2
beyond, a room is stable if the largest singular value of diag(eta(w T_i)) S R(i w) is below 1.
"""

from __future__ import annotations

import numpy as np

from cohaptic.control.stability.lag_choice import coupling_radius, lag_needed
from cohaptic.control.stability.room_roots import growth
from cohaptic_experiments.dyad.criteria import least
from cohaptic_server.numeric import Floats

FREQUENCIES: Floats = np.geomspace(1e-2, 1e3, 600)  # times 1 / T_max


def edge_by_roots(S: Floats, delays: Floats) -> float:
    """Lag above which the room is stable at exactly these delays [s].

    Args:
        S: Shape (n, n).
        delays: Shape (n,) [s].
    """
    return least(lambda lag: growth(S, delays, lag) < 0.0)


def edge_by_theorem(S: Floats, delays: Floats) -> float:
    """Lag above which it is stable for all delays up to the longest, science 3.8 [s]."""
    return lag_needed(coupling_radius(S), float(delays.max()))


def edge_by_small_gain(S: Floats, delays: Floats) -> float:
    """Lag above which the small gain theorem finds it stable for all delays up to these [s]."""
    w = FREQUENCIES / float(delays.max())
    eta = 2.0 * np.sin(0.5 * np.minimum(w[:, None] * delays, np.pi))

    def stable(lag: float) -> bool:
        R = np.linalg.inv((1.0 + 1j * w * lag)[:, None, None] * np.eye(len(S)) + S)
        size = np.linalg.norm(eta[:, :, None] * (S @ R), ord=2, axis=(1, 2))
        return bool((size < 1.0).all())

    return least(stable)
