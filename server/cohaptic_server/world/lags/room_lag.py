"""The room's lag, from the loop that its hands close in one tick (science 3.8, 3.13)."""

from __future__ import annotations

from cohaptic.control.room_lag import RoomLag
from cohaptic.control.stability.anticipation import lag_of_hands, lag_where_turned
from cohaptic.control.stability.lag_choice import EXACT, choose_lag, margin
from cohaptic.protocol.patch import MAX_COUPLING, MAX_LAG
from cohaptic_server.world.lags.planning import Planned
from cohaptic_server.world.lags.room_loop import RoomLoop

# Seconds that the lag falls per second while it is below this value; above it, it falls by its own
# size per second. It may rise at once: the room needs the longer lag now, and a longer lag only
# slows the forces on their way. If it fell at once, forces that it still holds back would reach the
# body within one tick, as a jump.
FALL_RATE = 0.2


def find_lag(loop: RoomLoop, plan: Planned, previous: RoomLag, dt: float) -> RoomLag:
    """The room's lag for the next tick.

    Args:
        loop: That the hands close.
        plan: What is anticipated of it.
        previous: Lag of the last tick.
        dt: Simulation period N T [s].
    """
    # The gains of the paper's laws are chosen for any delay; such users need no lag.
    needed, m, gains = 0.0, plan.m, plan.gains
    if gains is not None:
        hands = (gains, loop.damping_budget, loop.stiffest)
        needed = lag_where_turned(*hands, plan.late) if plan.late else lag_of_hands(*hands)
    elif loop.predictive:
        needed = choose_lag(m, loop.longest_delay, loop.damping_budget).lag
    lag = max(needed, previous.lag - max(FALL_RATE, previous.lag) * dt)
    # A lag beyond the range of the wire is cut to it, so that patches still go out; the margin
    # then shows that it is too short.
    lag = min(MAX_LAG, lag)
    edge = margin(m, loop.longest_delay, lag)
    if gains is not None:
        edge = 1.0 / gains.held if gains.held > EXACT else float("inf")
    return RoomLag(lag, min(MAX_COUPLING, m), edge)
