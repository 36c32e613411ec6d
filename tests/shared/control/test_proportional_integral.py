from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.control.proportional_integral import (
    AT_REST_SPEED,
    IntegralState,
    Thresholds,
    integration_threshold,
    proportional_integral_step,
)

T = 0.001  # s
RELEASE = 0.1  # s
forces = st.floats(0.0, 10.0)


def step(state: IntegralState, depth: float, theta: Thresholds) -> tuple[IntegralState, float]:
    return proportional_integral_step(state, depth, 100.0, 2000.0, theta, RELEASE, 10.0, T)


@given(forces, st.floats(-0.01, 0.0))
def test_without_contact_nothing_is_tolerated(force: float, depth: float) -> None:
    """First line of (17) and (18)."""
    assert integration_threshold(IntegralState(force), depth, 1e-3, 4e-3, 1.0, T) == 0.0


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


@given(forces, st.floats(1e-4, 0.01), st.floats(1e-4, 0.01))
def test_eq_17_is_one_threshold(force: float, before: float, depth: float) -> None:
    state = IntegralState(force, 0.0, before)
    assert integration_threshold(state, depth, 4e-3, 4e-3, 0.0, T) == 4e-3


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
