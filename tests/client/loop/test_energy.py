from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import settings as tried
from hypothesis import strategies as st

from cohaptic.control.friction import Compliance3
from cohaptic.vec import Vec3, add, scale
from cohaptic_client.loop.arrival import (
    receive,
)
from cohaptic_client.loop.passivity import Passivity
from cohaptic_client.loop.step import step
from tests.client.loop.loop_cases import (
    PACE,
    PERIOD,
    ROUNDING,
    WIDE,
    at,
    engaged,
)
from tests.client.plane import PLANE, STIFFNESS
from tests.examples_of_laws import examples
from tests.strategies import vectors


@given(
    st.lists(st.tuples(*[st.floats(-2e-4, 2e-4)] * 3), min_size=2, max_size=40),
    st.sampled_from([0.0, 50.0]),
    vectors(5.0),
)
@tried(max_examples=examples(60), deadline=None)
def test_a_closed_way_over_a_resting_spring_makes_nothing(
    ways: list[Vec3], friction: float, own_force: Vec3
) -> None:
    """To rounding, whatever force of the hand the body carries; along the surface, too, as long as
    it sticks (mu of 50).
    """
    settings = replace(WIDE[1], friction=friction)
    # Where pressing moves the contact along, friction and normal force find each other in steps.
    C = Compliance3(0.003, 0.005, 1.0 / STIFFNESS, 1e-3, 0.0, 0.0)
    patch = replace(PLANE, compliance=C if friction > 0.0 else None, own_force=own_force)
    # Deep enough to stay in contact.
    tip, now = (0.0, 0.0, -0.02), 10.0
    state = engaged(patch, settings)
    # Energy that was there at the start was not the spring's doing.
    for _ in range(2):
        state, _ = step(state, at(tip), now, settings)
        now += PERIOD
    state = replace(state, passivity=replace_owed(state.passivity))
    for way in ways + [scale(way, -1.0) for way in reversed(ways)]:
        tip = add(tip, way)
        state, output = step(state, at(tip), now, settings)
        now += PERIOD
        # At every point, not only at the end: stored energy can be got back.
        assert state.passivity.owed <= ROUNDING
        assert output.damping_force == pytest.approx(0.0, abs=1e-6)


def replace_owed(passivity: Passivity) -> Passivity:
    """The same spring, of which nothing is owed."""
    return Passivity(0.0, 0.0, passivity.stored)


@given(st.floats(0.001, 0.02), st.floats(-1e-4, 1e-4), st.floats(0.0, 5.0))
def test_what_a_surface_makes_is_force_more_than_the_body_had_times_way(
    depth: float, lift: float, own: float
) -> None:
    """(f - own_force) dx, as the hand rests and the surface comes: science 3.4."""
    held = replace(WIDE[1], smoothing=0.0)
    patch = replace(PLANE, own_force=(0.0, 0.0, own))
    state, tip, now = engaged(patch, held), at((0.0, 0.0, -depth)), 10.0
    for _ in range(2):
        state, _ = step(state, tip, now, held)
        now += PERIOD
    state = replace(state, passivity=replace_owed(state.passivity))
    # No faster than others may move a hand.
    limit = 0.99 * PACE / STIFFNESS
    lift = min(max(lift, -limit), limit)
    state = receive(state, replace(patch, tick=2, x_free=(0.0, 0.0, lift)), now, held)
    state, output = step(state, tip, now, held)
    mean = output.local.normal_force - 0.5 * STIFFNESS * lift
    assert state.passivity.owed == pytest.approx(max(0.0, (mean - own) * lift), abs=1e-12)
