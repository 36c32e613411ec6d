"""Worlds that are advanced by the same touches, for the tests of a tick."""

from __future__ import annotations

import math
from collections.abc import Sequence

from hypothesis import strategies as st

from cohaptic.protocol.patch import Patch
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.bodies.touched_body import TouchedBody
from cohaptic_server.world.applied_forces import RELEASE_TIME
from cohaptic_server.world.state import Touch
from cohaptic_server.world.tick import advance
from cohaptic_server.world.users import WorldState

DT = 1.0 / 60.0  # s
# Ticks until a newcomer's force counts in full; one more than the quotient, for its rounding.
RISE = math.ceil(RELEASE_TIME / DT) + 1

angles = st.floats(-math.pi, math.pi)
forces = st.floats(0.0, 10.0)
depths = st.floats(-0.01, 0.02)


def play(
    body: Balloon, touches: Sequence[Touch], ticks: int = RISE, state: WorldState | None = None
) -> tuple[WorldState, dict[int, Patch]]:
    """The world after some ticks of the same touches, and its last patches."""
    state, patches = state or WorldState(), dict[int, Patch]()
    touched = TouchedBody(body)
    for _ in range(ticks):
        state, patches = advance(touched, state, touches, now=(state.tick + 1) * DT, dt=DT)
    return state, patches
