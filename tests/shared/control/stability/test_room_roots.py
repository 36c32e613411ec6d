from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.special import lambertw

from cohaptic.control.stability.lag_choice import coupling_radius, lag_needed
from cohaptic.control.stability.room_roots import LARGEST, growth, largest_growth, unknowns
from cohaptic.control.stability.single_contact import Floats
from tests.examples_of_laws import examples
from tests.shared.control.stability.rooms import draw

seeds = st.integers(0, 2**32 - 1)
# Longest delay over the lag.
ratios = st.floats(-1.5, 1.5).map(lambda x: 10.0**x)


def by_lambert(S: Floats, T: float, lag: float) -> float:
    """The rightmost root for equal delays: of 1 + s tau = -lambda e^(-s T) for each eigenvalue."""
    found: list[float] = []
    eigenvalues: list[float] = np.linalg.eigvalsh(S).tolist()
    for x in eigenvalues:
        if abs(x) < 1e-12:
            found.append(-1.0 / lag)  # of the lag itself: nothing comes back
            continue
        for branch in range(-4, 5):
            w = complex(lambertw(-x * T / lag * math.exp(T / lag), branch))
            found.append(w.real / T - 1.0 / lag)
    return max(found)


def roots_right_of(x: float, S: Floats, delays: Floats, lag: float) -> int:
    """Number of roots with Re s > x by the argument principle, from nothing but the determinant."""
    E = np.exp(-0.5 * x * delays)
    radius = float(np.abs(np.linalg.eigvalsh(E[:, None] * S * E)).max())
    # |1 + s tau| <= radius holds for every root there.
    far = 1.01 * (radius + 1.0) / lag
    corners = [complex(x, -far), complex(far, -far), complex(far, far), complex(x, far)]

    def angles(s: npt.NDArray[Any]) -> Floats:
        M = np.exp(-s[:, None] * delays)[:, :, None] * S
        det = np.linalg.det(M + (1.0 + s * lag)[:, None, None] * np.eye(len(S)))
        return np.asarray(np.arctan2(det.imag, det.real))

    turns = 0.0
    for a, b in zip(corners, [*corners[1:], corners[0]], strict=True):
        s = np.linspace(a, b, 4000)
        angle = angles(s)
        # Next to a root the angle turns fast: halve until it is fine enough to count.
        for _ in range(40):
            step = np.remainder(np.diff(angle) + math.pi, 2.0 * math.pi) - math.pi
            coarse = np.flatnonzero(np.abs(step) > 1.0)
            if len(coarse) == 0:
                break
            between = 0.5 * (s[coarse] + s[coarse + 1])
            s = np.insert(s, coarse + 1, between)
            angle = np.insert(angle, coarse + 1, angles(between))
        else:
            raise AssertionError("the angle is not resolved")
        turns += float(step.sum())
    return round(turns / (2.0 * math.pi))


@given(seeds, ratios)
@settings(max_examples=examples(150))
def test_equal_delays_have_a_closed_form(seed: int, ratio: float) -> None:
    room = draw(np.random.default_rng(seed), equal_delays=True)
    T = float(room.delays[0])
    lag = T / ratio
    assert growth(room.coupling, room.delays, lag) * T == pytest.approx(
        by_lambert(room.coupling, T, lag) * T, abs=1e-8
    )


@given(seeds, st.floats(-0.7, 0.7).map(lambda x: 10.0**x))
@example(seed=8896, ratio=2.472522657659735)  # two roots nearly as far right as each other
@settings(max_examples=examples(30))
def test_the_argument_principle_finds_roots_on_one_side_and_none_on_the_other(
    seed: int, ratio: float
) -> None:
    room = draw(np.random.default_rng(seed))
    S, delays, lag = room.coupling, room.delays, float(room.delays.max()) / ratio
    rate = growth(S, delays, lag)
    step = 0.02 / (lag + float(delays.max()))
    assert roots_right_of(rate + step, S, delays, lag) == 0
    assert roots_right_of(rate - step, S, delays, lag) >= 1


@given(seeds, ratios, st.floats(0.001, 1000.0))
@settings(max_examples=examples(50))
def test_time_has_no_scale_of_its_own(seed: int, ratio: float, scale: float) -> None:
    room = draw(np.random.default_rng(seed))
    longest = float(room.delays.max())
    for lag in (0.0, longest / ratio):
        rate = growth(room.coupling, room.delays, lag)
        slower = growth(room.coupling, scale * room.delays, scale * lag)
        assert scale * slower * longest == pytest.approx(rate * longest, rel=1e-6, abs=1e-7)


@given(seeds, ratios)
@settings(max_examples=examples(100))
def test_the_closed_bound_is_one(seed: int, ratio: float) -> None:
    room = draw(np.random.default_rng(seed))
    longest = float(room.delays.max())
    lag = longest / ratio
    bound = largest_growth(room.coupling, room.delays, lag)
    assert growth(room.coupling, room.delays, lag) * longest <= bound * longest + 1e-7


@given(st.floats(0.01, 0.999), st.floats(0.01, 1.0), st.floats(0.01, 1.0))
def test_two_users_without_a_lag_forget_by_their_coupling_squared_in_both_loops(
    c: float, first: float, second: float
) -> None:
    S = np.array([[0.0, c], [c, 0.0]])
    rate = growth(S, np.array([first, second]), 0.0)
    assert rate == pytest.approx(2.0 * math.log(c) / (first + second), rel=1e-9)


@given(seeds)
def test_without_a_lag_a_room_is_stable_iff_m_is_below_one(seed: int) -> None:
    room = draw(np.random.default_rng(seed))
    m = coupling_radius(room.coupling)
    for S, stable in ((0.999 / m * room.coupling, True), (1.001 / m * room.coupling, False)):
        assert (growth(S, room.delays, 0.0) < 0.0) is stable


def on_a_grid(S: Floats, steps: list[int]) -> float:
    """Growth for delays of whole steps of 1 s, without a lag, by the companion matrix [1/s]."""
    n, longest = len(S), max(steps)
    A = np.eye(n * longest, k=-n)
    for i, delay in enumerate(steps):
        A[i, n * (delay - 1) : n * delay] = -S[i]
    return math.log(float(np.abs(np.linalg.eigvals(A)).max()))


def test_without_a_lag_the_growth_is_the_largest_of_delays_next_to_the_given_ones() -> None:
    """On a grid of delays none grows faster than that, and one comes near it."""
    S = np.array([[0.0, 0.9, 0.5], [0.9, 0.0, 0.7], [0.5, 0.7, 0.0]])
    S *= 1.3 / coupling_radius(S)
    fractions: list[float] = []
    for i in range(28, 33):
        for j in range(18, 23):
            steps = [i, 24, j]
            fractions.append(on_a_grid(S, steps) / growth(S, np.array(steps, dtype=float), 0.0))
    assert max(fractions) <= 1.0 + 1e-9
    assert max(fractions) > 0.98
    assert min(fractions) < 0.8  # or every one of them would do


def test_a_large_room_is_exact_at_the_lag_that_it_needs_and_bounded_far_below() -> None:
    rng = np.random.default_rng(0)
    A = np.abs(rng.normal(size=(64, 100)))
    C = A @ A.T
    scale = 1.0 / np.sqrt(np.diag(C))
    S = C * np.outer(scale, scale) - np.eye(64)
    m, T = coupling_radius(S), np.full(64, 0.2)
    edge = lag_needed(m, 0.2)
    for fraction in (0.999, 1.001):
        lag = fraction * edge
        rate = growth(S, T, lag)
        assert (rate < 0.0) is (fraction > 1.0)
        assert rate == pytest.approx(by_lambert(S, 0.2, lag), abs=1e-9)
    short = 1e-3 * edge
    assert unknowns(T, short, m / short) > LARGEST
    assert growth(S, T, short) == largest_growth(S, T, short)
    assert growth(S, T, short) >= by_lambert(S, 0.2, short)
