"""A world that everybody has left comes to rest, and is that of the beginning but for its number.

At rest a tick changes its number and nothing else, so that ticks of which nobody hears need not be
made: a room that slept through them and one that did not are the same.
"""

from __future__ import annotations

from dataclasses import replace

from cohaptic_server.world.lags.planning import CALM_TIME
from cohaptic_server.world.users import WorldState

# J; what is left of a swing or a dent below it would push a fingertip by less than
# `state.NEGLIGIBLE`: where the compliance is C, a surface that holds U pushes by sqrt(2 U / C) at
# the most, and nothing that is touched is stiffer than C = 2e-6 m/N.
REST_ENERGY = 1e-12


def is_at_rest(state: WorldState) -> bool:
    """Whether nothing is left of anybody, as before the first touch."""
    return state.response is None and not len(state.users) and not state.releases


def pass_over(state: WorldState, ticks: int) -> WorldState:
    """A world at rest after so many ticks in which nobody took part."""
    return replace(state, tick=state.tick + ticks)


def settled(state: WorldState, now: float) -> WorldState:
    """The same, or the world of the beginning if too little is left of everybody to be felt.

    Args:
        state: After a tick.
        now: Time of the tick [s].
    """
    response = state.response
    if response is None or len(state.users) or state.releases:
        return state
    if state.room.lag > 0.0 or now - state.unknown_at < CALM_TIME:
        return state
    return WorldState(state.tick) if abs(response.energy) <= REST_ENERGY else state
