from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.control.gains import choose_gains
from cohaptic.control.law import Law
from cohaptic.control.laws.model import Thresholds
from cohaptic.control.laws.pi import (
    AT_REST_SPEED,
    IntegralState,
    integration_threshold,
    proportional_integral_step,
)

T = 0.001  # s
K_H = 100.0  # N/m
RELEASE = 0.1  # s
ROUNDING = 1e-9  # N
forces = st.floats(0.0, 10.0)
depths = st.floats(-0.01, 0.03)


def step(
    state: IntegralState,
    depth: float,
    theta: Thresholds,
    moved_in: float = 0.0,
    limit: float = math.inf,
) -> tuple[IntegralState, float]:
    return proportional_integral_step(
        state, depth, K_H, 2000.0, theta, RELEASE, 10.0, T, moved_in, limit
    )


@given(forces, st.floats(1e-4, 0.01), st.floats(0.0, 0.01))
def test_eq_18_small_on_the_way_in_large_on_the_way_out(
    force: float, depth: float, deeper: float
) -> None:
    going_in = IntegralState(force, 0.0, depth)
    assert integration_threshold(going_in, depth + deeper, 1e-3, 4e-3, 2.0, T) == 1e-3
    resting = IntegralState(force, 0.0, depth + 0.5 * AT_REST_SPEED * T)
    assert integration_threshold(resting, depth, 1e-3, 4e-3, 2.0, T) == 1e-3
    coming_out = IntegralState(force, 0.0, depth + deeper + 2.0 * AT_REST_SPEED * T)
    expected = 4e-3 * min(1.0, force / 2.0)
    assert integration_threshold(coming_out, depth, 1e-3, 4e-3, 2.0, T) == pytest.approx(expected)


@given(st.floats(0.1, 10.0), st.floats(0.001, 0.02))
def test_when_contact_ends_the_integral_goes_to_zero_linearly(force: float, depth: float) -> None:
    """Section 5.1: over `release_time`, from whatever it was."""
    state, _ = step(IntegralState(force, 0.0, depth), depth, Thresholds(depth, depth, 0.0))
    given_off = list[float]()
    for _ in range(round(RELEASE / T) + 2):
        state, f = step(state, -1e-3, Thresholds())
        given_off.append(f)
    ends = round(RELEASE / T)
    for k in (0, ends // 2, ends - 2):
        assert given_off[k] == pytest.approx(force * (1.0 - (k + 1) * T / RELEASE), abs=1e-9)
    assert given_off[-1] == pytest.approx(0.0, abs=1e-12)


@given(st.lists(st.floats(-0.02, 0.05), min_size=1, max_size=200))
def test_the_integral_stays_between_nothing_and_the_hands_limit(path: list[float]) -> None:
    state = IntegralState()
    for depth in path:
        state, force = step(state, depth, Thresholds())
        assert 0.0 <= state.force <= 10.0
        assert force >= 0.0


@given(forces, depths, depths, st.floats(-0.01, 0.01), st.floats(0.0, 0.05), st.floats(0.0, 100.0))
def test_others_change_the_whole_force_by_no_more_than_the_limit(
    force: float, before: float, depth: float, moved_in: float, limit: float, ramp: float
) -> None:
    """Whatever surface comes, unless the integral has nothing more to give, or no room."""
    state = IntegralState(force, ramp, before)
    after, now = step(state, depth, Thresholds(), moved_in, limit)
    change = now - (force + K_H * max(0.0, before))
    own = K_H * moved_in
    if after.force > 0.0:
        assert change <= max(0.0, own) + limit + ROUNDING
    if after.force < 10.0:
        assert change >= min(0.0, own) - limit - ROUNDING


@given(forces, depths, st.floats(0.0, 100.0))
def test_a_force_taken_from_a_surface_that_left_goes_to_zero_in_time(
    force: float, before: float, ramp: float
) -> None:
    state, f, limit = IntegralState(force, ramp, before), math.inf, 0.02
    start = force + K_H * max(0.0, before)
    for _ in range(round(start / limit) + round(RELEASE / T) + 2):
        state, f = step(state, -1e-3, Thresholds(), 0.0, limit)
    assert f == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("periods", [1, 5, 15, 30])
def test_the_limit_does_not_make_a_hand_swing_that_jumps_far_into_the_object(periods: int) -> None:
    """In the loop of one hand, with the server's gains and so many simulation periods of delay."""
    k_o, n = 1000.0, 17
    gains = choose_gains(
        Law.PI,
        [1.0 / k_o],
        0,
        max_stiffness=1e9,
        loop_delay=periods * n * T,
        simulation_period=n * T,
    )
    state, x, reported, before, newest = IntegralState(), 0.0, [0.0] * periods, 0.0, 0.0
    given_off = list[float]()
    for k in range(20_000):
        if k % n == 0:  # the dent of a force that is so many periods old
            before, newest = newest, reported[-periods] / k_o
            reported.append(given_off[-1] if given_off else 0.0)
        dent = before + (k % n + 1) / n * (newest - before)
        way, x = (0.008, 0.008) if k == 200 else (0.0, x)
        state, f = proportional_integral_step(
            state, x - dent, gains.k_h, gains.integral_gain, Thresholds(0.0, 0.0), RELEASE, 20.0, T,
            way, 0.02,
        )  # fmt: skip
        given_off.append(f)
    assert min(given_off[-4000:]) == pytest.approx(8.0, rel=1e-3)
    assert max(given_off[-4000:]) == pytest.approx(8.0, rel=1e-3)
