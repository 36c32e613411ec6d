"""A room as it is sampled: forces once in a simulation period, each loop delay in whole periods.

Exact for any gains, with the paper's integral and with the room's lag (science 3.8), which is
stepped as the server does. `room_roots.py` is its counterpart in continuous time.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from cohaptic.control.law import Gains, Law
from cohaptic.control.stability.lag_choice import kept
from cohaptic.control.stability.single_contact import Floats, spectral_radius

Ints = npt.NDArray[np.int64]


def loop_matrix(C: Floats, law: Law) -> Floats:
    """M of the iteration f <- K (x_h - M f), shape (n, n) [m/N]."""
    return C - np.diag(np.diag(C)) if law is Law.PREDICTIVE else C


def room_radius(
    C: Floats,
    gains: Sequence[Gains],
    law: Law,
    delays: Ints,
    simulation_period: float,
    lag: float = 0.0,
) -> float:
    """Spectral radius of a whole room over one simulation period; stable iff < 1.

    At tick k user i receives the body's response to everybody's forces of tick k - delays[i]. Only
    its own round trip counts: the delay from j to i is up_j + down_i, and moving up_j to j's side
    is a change of variables.

    Args:
        C: Contact compliance, shape (n, n) [m/N].
        gains: Of each user.
        law: Of everybody.
        delays: Simulation periods round each user's loop, at least 1, shape (n,).
        simulation_period: N T [s].
        lag: Of the room, through which every force enters the body [s].
    """
    n, longest = len(C), int(delays.max())
    M = loop_matrix(C, law)
    k_h = np.array([g.k_h for g in gains])
    # The predictive law has no integral, whatever its gains say.
    integrals = 0.0 if law is Law.PREDICTIVE else simulation_period
    rate = np.array([g.integral_gain for g in gains]) * integrals
    # State: the integrals, then everybody's forces behind the lag of the last `longest` ticks.
    A = np.zeros((n * (longest + 1),) * 2)
    seen = np.zeros((n, len(A)))  # depth of each probe, held still, below its surface
    for i in range(n):
        seen[i, n * delays[i] : n * (delays[i] + 1)] = -M[i]
    own = np.zeros((n, len(A)))
    own[:, :n] = np.eye(n)
    A[:n] = own + rate[:, None] * seen
    A[np.flatnonzero(rate == 0.0)] = 0.0  # no integral: it stays at zero
    old = kept(lag, simulation_period)
    A[n : 2 * n] = (1.0 - old) * (k_h[:, None] * seen + own)
    A[n : 2 * n, n : 2 * n] += old * np.eye(n)
    for age in range(2, longest + 1):
        A[n * age : n * (age + 1), n * (age - 1) : n * age] = np.eye(n)
    if not rate.any():
        return spectral_radius(A[n:, n:])
    return spectral_radius(A)
