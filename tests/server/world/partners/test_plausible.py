"""What is believed of a hand whose client may say anything."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.protocol.frame import MAX_FORCE, MAX_POSITION
from cohaptic_server.world.partners.learning import FIRST_LAG, glide, unknown
from cohaptic_server.world.partners.plausible import (
    deflection_of,
    depth_of,
    doubt,
    lag_of,
    moved,
    strength,
)
from cohaptic_server.world.partners.small_gain import LAGS
from tests.server.touches import touch

forces = st.floats(0.0, MAX_FORCE)
depths = st.floats(-2.0 * MAX_POSITION, 2.0 * MAX_POSITION)
compliances = st.floats(1e-5, 0.1)


@given(forces, forces, forces, depths, compliances)
def test_a_hand_is_no_deeper_than_its_device_can_press(
    reported: float, push: float, limit: float, depth: float, compliance: float
) -> None:
    hand, sample = replace(unknown(1), peak=reported), touch(max_force=limit)
    believed, doubted = depth_of(sample, hand, depth, compliance, push)
    assert -0.05 <= believed <= compliance * limit
    assert believed <= max(depth, -0.05)
    assert doubted is (
        depth > 2.0 * compliance * min(limit, 1.1 * max(reported, push) + 0.5) + 0.005
    )


@given(forces, forces, depths, compliances)
def test_the_depth_that_is_believed_follows_no_force(
    reported: float, other: float, depth: float, compliance: float
) -> None:
    """A hand whose force comes slowly, after a break, would swing with its own depth."""
    before, after = (replace(unknown(1), peak=peak) for peak in (reported, other))
    sample = touch(max_force=20.0)
    assert (
        depth_of(sample, before, depth, compliance, 0.0)[0]
        == depth_of(sample, after, depth, compliance, 0.0)[0]
    )


@given(st.floats(0.0, 50.0), compliances, st.floats(0.9, 1.1))
def test_who_is_as_deep_as_it_presses_is_believed(
    force: float, compliance: float, rounding: float
) -> None:
    hand, sample = replace(unknown(1), peak=force), touch(max_force=100.0)
    depth = compliance * force * rounding
    assert depth_of(sample, hand, depth, compliance, 0.0) == (depth, False)


@given(forces, st.floats(-MAX_POSITION, MAX_POSITION))
def test_a_give_is_one_that_the_told_forces_make(reported: float, deflection: float) -> None:
    hand = replace(unknown(1), peak=reported)
    believed = deflection_of(touch(deflection=deflection, max_force=MAX_FORCE), hand)
    assert abs(believed) <= 2.0 * (reported + 0.5) / hand.model.stiffness + 1e-12
    assert believed * deflection >= 0.0


@given(depths, depths, st.floats(0.0, 0.1))
def test_what_a_hand_wants_moves_as_fast_as_a_hand(before: float, wanted: float, dt: float) -> None:
    after = moved(before, wanted, dt)
    assert abs(after - before) <= 1.5 * dt + 1e-12
    assert min(before, wanted) - 1e-12 <= after <= max(before, wanted) + 1e-12


def test_who_tells_the_implausible_is_heard_with_the_longest_lag_for_a_while() -> None:
    hand, lags = doubt(unknown(1)), list[float]()
    for _ in range(200):
        lags.append(lag_of(hand))
        hand = glide(hand, 0.0, 0.02)
    assert lags[0] == LAGS[-1]
    assert lags[-1] == FIRST_LAG
    # It falls so slowly that what the hand wants makes no jump.
    assert np.diff(lags) == pytest.approx(np.maximum(-0.002, FIRST_LAG - np.array(lags[:-1])))


@given(st.lists(st.floats(0.0, 100.0), max_size=50), st.floats(0.005, 0.1))
def test_a_pulse_now_and_then_gives_a_model_little_strength(
    reported: list[float], dt: float
) -> None:
    hand, before = unknown(1), 0.0
    for force in reported:
        hand = glide(hand, force, dt)
        assert hand.peak <= max(before, min(force, before + 60.0 * dt)) + 1e-9
        assert strength(hand) <= 1.25 * max(reported) + 1.0 + 1e-9
        before = hand.peak
