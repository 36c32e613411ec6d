from __future__ import annotations

import itertools
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.control.predictive import RELEASE_SLOPE, predictive_step

T = 0.001  # s
stiffness = st.floats(50.0, 800.0)
shares = st.floats(0.1, 1.0)
rates = st.floats(0.1, 20.0)  # 1/s, of the integral
depths = st.floats(-0.01, 0.03)


def play(depths: list[float], k_h: float, rate: float, c: float) -> list[float]:
    integral, forces = 0.0, list[float]()
    for depth in depths:
        integral, force = predictive_step(integral, depth, k_h, rate / c, c, T)
        forces.append(force)
    return forces


@given(stiffness, shares, st.floats(0.5, 20.0), st.floats(0.001, 0.03))
def test_the_integral_brings_any_gain_to_k_o(
    k_o: float, share: float, rate: float, depth: float
) -> None:
    """f -> d / C_ii, along 1 - e^(-a t)."""
    forces = play([depth] * round(8.0 / (rate * T)), share * k_o, rate, 1.0 / k_o)
    assert forces[0] == pytest.approx(share * k_o * depth, rel=rate * T / share + 1e-9)
    assert forces[-1] == pytest.approx(k_o * depth, rel=1e-3)
    at = round(1.0 / (rate * T))
    expected = k_o * depth * (1.0 - (1.0 - share) * math.exp(-at * rate * T))
    assert forces[at - 1] == pytest.approx(expected, rel=0.03)


@given(st.lists(depths, min_size=2, max_size=60), stiffness, shares, rates)
def test_it_never_pulls_and_never_exceeds_twice_the_truth(
    path: list[float], k_o: float, share: float, rate: float
) -> None:
    for depth, force in zip(path, play(path, share * k_o, rate, 1.0 / k_o), strict=True):
        assert 0.0 <= force <= RELEASE_SLOPE * k_o * max(0.0, depth) * (1.0 + 1e-9)


@given(stiffness, shares, rates, st.floats(0.002, 0.03), st.floats(0.001, 0.2))
def test_a_hand_that_leaves_feels_no_step(
    k_o: float, share: float, rate: float, depth: float, speed: float
) -> None:
    """The force ends where the contact ends, at most twice as steeply as the body."""
    rest = [depth] * 500
    way = [depth - speed * T * k for k in range(int(depth / (speed * T)) + 3)]
    forces = play(rest + way, share * k_o, rate, 1.0 / k_o)
    steepest = RELEASE_SLOPE * k_o * speed * T + rate * T * k_o * depth
    for before, after in itertools.pairwise(forces[500:]):
        assert abs(after - before) <= steepest * (1.0 + 1e-9)
    assert forces[-1] == 0.0


@given(stiffness, depths)
def test_without_an_integral_it_is_the_plain_gain(k_o: float, depth: float) -> None:
    integral, force = predictive_step(0.0, depth, k_o, 0.0, 1.0 / k_o, T)
    assert (integral, force) == (0.0, k_o * max(0.0, depth))
