"""Choose the gains of a client's law; `stability/lag_choice.py` chooses the room's lag.

No gain exceeds the stiffness that the device renders stably (Colgate's limit, as the device states
it). If that limit is less than the object's stiffness, the hand feels the device's limit.
"""

from __future__ import annotations

from collections.abc import Sequence

from cohaptic.control.law import Law
from cohaptic.control.laws.model import Gains

# Ratio of a gain to the edge of stability. At 0.9 an error in a proportional loop falls by 10 % in
# each round trip. With 0.95 the error of an earlier law was 10 % in place of 6 % at the 95th
# percentile (`cohaptic experiment hands`).
ALPHA = 0.9


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
    return law.model.gains(row, i, max_stiffness, loop_delay, simulation_period, alpha)
