"""Choose the gains of a client's law; `stability/lag_choice.py` chooses the room's lag.

C_ij is the displacement of contact i per force at contact j, and K_h,i or K_i the gain of client i.

    proportional   K_h,i < 1 / sum_j |C_ij|, stable at any bounded delay (3.2; Chazan and Miranker
                   1969); for a single hand this is eq. (8)
    pi             K_h,i a fraction of the same bound, and the integral gain I a fraction of the
                   edge of the stability area at the measured delay (3.1)
    predictive     K_i = 1 / C_ii at any delay and with any other hands (3.8): the room's lag keeps
                   several hands stable, and no gain is lowered because of other hands

No gain exceeds the stiffness that the device renders stably (Colgate's limit, as the device states
it). If that limit is less than the object's stiffness, the hand feels the device's limit.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import assert_never

from cohaptic.control.law import Gains, Law
from cohaptic.control.stability.single_contact import elastic_object, integral_model, lifted_radius

# Ratio of a gain to the edge of stability. At 0.9 an error in a proportional loop falls by 10 % in
# each round trip.
ALPHA = 0.9
# For `pi`: ratio of K_h to the coupled stiffness, and of I to the largest stable I. In the steady
# state the integral provides the force; a larger K_h improves little and oscillates more.
PI_SHARE_K = 0.3
PI_SHARE_I = 0.3
LONGEST_DELAY = 64  # simulation periods; for longer loops I is chosen as for this delay


def coupled_stiffness(row: Sequence[float]) -> float:
    """Return the coupling-aware stiffness 1 / sum_j |C_ij| of contact i (science 3.2) [N/m].

    Args:
        row: Row i of the compliance matrix C of all contacts, C_ii included [m/N].
    """
    return 1.0 / sum(abs(c) for c in row)


def choose_gains(
    law: Law,
    row: Sequence[float],
    i: int,
    *,
    max_stiffness: float,
    loop_delay: float,
    simulation_period: float,
    fixed: Gains | None = None,
    alpha: float = ALPHA,
) -> Gains:
    """Choose the gains of client i for the law that the client runs.

    Args:
        row: Row i of the compliance matrix C of all present contacts [m/N].
        i: Index of the client's own contact in `row`.
        max_stiffness: Largest gain that the client's device renders stably [N/m].
        loop_delay: Measured time from the tick that makes a patch to the tick that gets the force
            made with that patch (`delay.LoopDelay`), plus the room's lag [s].
        simulation_period: Simulation period N T [s].
        fixed: Gains that the client requests and the server grants, for experiments only; None to
            choose gains.
        alpha: Ratio of a proportional gain to the edge of stability, < 1.
    """
    if fixed is not None:
        return Gains(min(fixed.k_h, max_stiffness), fixed.integral_gain)
    if law is Law.PREDICTIVE:
        return Gains(min(1.0 / row[i], max_stiffness))
    coupled = coupled_stiffness(row)
    if law is Law.PROPORTIONAL:
        return Gains(min(alpha * coupled, max_stiffness))
    if law is not Law.PI:
        assert_never(law)
    # The integral, too, must stay within the stiffness that the device renders.
    coupled = min(coupled, max_stiffness)
    k_h = PI_SHARE_K * coupled
    # The client blends to a new patch over one period, which adds one period of delay.
    periods = min(LONGEST_DELAY, math.ceil(loop_delay / simulation_period - 1e-6) + 1)
    edge = largest_integral(k_h / coupled, periods)
    return Gains(k_h, PI_SHARE_I * edge * coupled / simulation_period)


@lru_cache(maxsize=4096)
def _edge(kappa_percent: int, periods: int) -> float:
    """Return the largest stable I N T / K_o for K_h / K_o [percent] and a loop of `periods` N T."""
    body = elastic_object(1.0)
    low, high = 0.0, 2.0
    while high - low > 1e-3 * high:
        middle = 0.5 * (low + high)
        local = integral_model(0.01 * kappa_percent, middle, 1.0)
        stable = lifted_radius(local, body, 1, periods - 1) < 1.0
        low, high = (middle, high) if stable else (low, middle)
    return low


def largest_integral(kappa: float, periods: int) -> float:
    """Return the largest stable integral gain, as I N T / K_o (edge of Fig. 8, with delay).

    Args:
        kappa: Ratio K_h / K_o of gain and stiffness; the function rounds it up to whole percent.
        periods: Loop delay in simulation periods N T; 1 is the paper's loop, without more delay.
    """
    return _edge(math.ceil(100.0 * kappa - 1e-9), max(1, periods))
