"""Rest: a world that all users have left becomes the initial world again, except its tick number.

At rest a tick changes only the number, so ticks without any client need not be computed: a room
that sleeps through these ticks ends in the same state as a room that computes them.
"""

from __future__ import annotations

from dataclasses import replace

from cohaptic_server.world.lags.planning import CALM_TIME
from cohaptic_server.world.users import WorldState

# J; a swing or dent with less energy would push a fingertip by less than `state.NEGLIGIBLE`: a
# surface of compliance C with the energy U pushes by sqrt(2 U / C) at most, and every touched place
# has C of at least 2e-6 m/N.
REST_ENERGY = 1e-12


def is_at_rest(state: WorldState) -> bool:
    """Whether no response, user or fading force is left, as before the first touch."""
    return state.response is None and not len(state.users) and not state.releases


def pass_over(state: WorldState, ticks: int) -> WorldState:
    """Return a world at rest after some ticks in which no user took part."""
    return replace(state, tick=state.tick + ticks)


def settled(state: WorldState, now: float) -> WorldState:
    """Return the initial world if no hand could feel what remains of `state`, else `state`.

    Args:
        state: State of the world after a tick.
        now: Time of the tick [s].
    """
    response = state.response
    if response is None or len(state.users) or state.releases:
        return state
    if state.room.lag > 0.0 or now - state.unknown_at < CALM_TIME:
        return state
    return WorldState(state.tick) if abs(response.energy) <= REST_ENERGY else state
