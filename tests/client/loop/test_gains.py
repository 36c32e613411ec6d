from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import settings as tried
from hypothesis import strategies as st

from cohaptic.control.geometry import Sight
from cohaptic.control.law import Law
from cohaptic.control.laws.model import Gains
from cohaptic.protocol.patch import Patch
from cohaptic.vec import ZERO
from cohaptic_client.loop.arrival import (
    receive,
)
from cohaptic_client.loop.gains import MAX_CHANGE, gains_under
from cohaptic_client.loop.slew import GAIN_RATE
from cohaptic_client.loop.step import step
from tests.client.loop.loop_cases import (
    PERIOD,
    ROUNDING,
    SETTINGS,
    at,
    engaged,
    near_patches,
)
from tests.client.plane import PLANE
from tests.examples_of_laws import examples
from tests.strategies import normals, single, vectors

gains = st.floats(0.1, 1e5)


@given(st.lists(st.tuples(near_patches, st.integers(0, 30)), min_size=1, max_size=4))
@tried(max_examples=examples(50))
def test_no_patch_moves_the_gain_faster_than_that(arrivals: list[tuple[Patch, int]]) -> None:
    state, now = engaged(PLANE), 10.0
    for tick, (patch, periods) in enumerate(arrivals, start=2):
        state = receive(state, replace(patch, tick=tick), now, SETTINGS)
        for _ in range(periods):
            before = state.k_h
            state, _ = step(state, at(ZERO), now, SETTINGS)
            assert abs(math.log(state.k_h / before)) <= GAIN_RATE * PERIOD + ROUNDING
            now += PERIOD


sights = st.builds(
    Sight, st.floats(-0.02, 0.02), normals, st.floats(1e-8, 1.0), vectors(5.0), vectors(0.02)
)


@given(near_patches, sights, st.floats(1e-4, 0.1), st.floats(10.0, 1e4))
def test_a_hand_has_the_objects_own_stiffness_where_it_is_or_the_devices(
    patch: Patch, sight: Sight, c_ii: float, limit: float
) -> None:
    """Nothing restores stiffness that a device takes, and no neighbour takes any (science 3.8)."""
    settings = replace(SETTINGS, max_stiffness=limit)
    predictive = replace(patch, law=Law.PREDICTIVE, c_ii=c_ii)
    here = min(max(sight.c_ii, c_ii / MAX_CHANGE), c_ii * MAX_CHANGE)
    # The server said the object's own, as 32 bits have it; or that the device is the softer.
    own = replace(predictive, k_h=single(1.0 / c_ii))
    assert gains_under(own, sight, settings).k_h == pytest.approx(min(1.0 / here, limit))
    soft = replace(predictive, k_h=min(0.9 / c_ii, limit))
    assert gains_under(soft, sight, settings).k_h == pytest.approx(min(1.0 / here, soft.k_h))


@given(near_patches, sights, st.floats(10.0, 1e4))
def test_gains_that_a_user_has_fixed_follow_nothing(
    patch: Patch, sight: Sight, limit: float
) -> None:
    settings = replace(SETTINGS, follow=False, max_stiffness=limit)
    found = gains_under(patch, sight, settings)
    assert found == Gains(min(patch.k_h, limit), patch.integral_gain)
