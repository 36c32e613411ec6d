"""The room's lag, from the loop that its hands close in one tick (science 3.8, 3.13)."""

from __future__ import annotations

from cohaptic.control.room_lag import RoomLag
from cohaptic.control.stability.anticipation import Gains, lag_of_hands
from cohaptic.control.stability.lag_choice import EXACT, choose_lag, margin
from cohaptic.protocol.patch import MAX_COUPLING, MAX_LAG
from cohaptic_server.world.lags.room_loop import RoomLoop

# Seconds that the lag falls per second while it is below this value; above it, it falls by its own
# size per second. It may rise at once: the room needs the longer lag now, and a longer lag only
# slows the forces on their way. If it fell at once, forces that it still holds back would reach the
# body within one tick, as a jump.
FALL_RATE = 0.2


def find_lag(
    loop: RoomLoop, m: float, gains: Gains | None, previous: RoomLag, dt: float
) -> RoomLag:
    """The room's lag for the next tick.

    Args:
        loop: That the hands close.
        m: Spectral radius of its coupling.
        gains: Of what anticipation leaves of it; None where nothing is anticipated.
        previous: Lag of the last tick.
        dt: Simulation period N T [s].
    """
    # The gains of the paper's laws are chosen for any delay; such users need no lag.
    needed = 0.0
    if gains is not None:
        needed = lag_of_hands(gains, loop.damping_budget, loop.stiffest)
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
