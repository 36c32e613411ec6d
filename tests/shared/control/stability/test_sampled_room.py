"""The room's lag as the server steps it, once in a simulation period (science 3.8)."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic.control.law import Law
from cohaptic.control.laws.model import Gains
from cohaptic.control.stability.lag_choice import coupling_matrix, coupling_radius, kept, lag_needed
from cohaptic.control.stability.several_contacts import room_radius
from tests.examples_of_laws import examples
from tests.shared.control.stability.rooms import draw

seeds = st.integers(0, 2**32 - 1)
times = st.floats(1e-3, 10.0)  # s
PERIOD = 1.0 / 60.0  # s


def after_a_period(lagged: float, force: float, lag: float, dt: float) -> float:
    """A force behind the lag after one simulation period in which `force` came in [N]."""
    return force + (lagged - force) * kept(lag, dt)


@given(st.floats(-10.0, 10.0), st.floats(-10.0, 10.0), times, times)
def test_a_lagged_force_goes_to_the_force_and_never_past_it(
    lagged: float, force: float, lag: float, dt: float
) -> None:
    after = after_a_period(lagged, force, lag, dt)
    assert min(lagged, force) - 1e-12 <= after <= max(lagged, force) + 1e-12
    assert after_a_period(lagged, force, 0.0, dt) == force
    assert after_a_period(force, force, lag, dt) == force


@given(seeds, st.lists(st.integers(1, 12), min_size=15, max_size=15))
@settings(max_examples=examples(200))
def test_sampled_rooms_obey_the_theorem_too(seed: int, ticks: list[int]) -> None:
    """Delays of whole simulation periods, the lag by `kept` once in each."""
    rng = np.random.default_rng(seed)
    room = draw(rng)
    n = len(room.stiffness)
    C = room.C[:n, :n]
    gains = [Gains(1.0 / float(c)) for c in np.diag(C)]
    delays = np.array(ticks[:n] if rng.random() < 0.5 else ticks[:1] * n)
    m = coupling_radius(coupling_matrix(C, [np.array([[g.k_h]]) for g in gains]))
    lag = 1.001 * lag_needed(m, PERIOD * float(delays.max()))
    assert room_radius(C, gains, Law.PREDICTIVE, delays, PERIOD, lag) < 1.0
    if m > 1.01 and len(set(delays.tolist())) == 1:
        assert room_radius(C, gains, Law.PREDICTIVE, delays, PERIOD, 0.0) > 1.0


@given(seeds, st.floats(1.0, 1e5))
@settings(max_examples=examples(20))
def test_the_predictive_law_has_no_integral_whatever_its_gains_say(seed: int, gain: float) -> None:
    room = draw(np.random.default_rng(seed))
    n = len(room.stiffness)
    C = room.C[:n, :n]
    delays = np.full(n, 3)
    radius = [
        room_radius(
            C, [Gains(1.0 / float(c), i) for c in np.diag(C)], Law.PREDICTIVE, delays, PERIOD
        )
        for i in (0.0, gain)
    ]
    assert radius[0] == radius[1]


@pytest.mark.parametrize(("m", "ticks"), [(1.02, 1), (1.1, 2), (1.05, 4)])
def test_an_exponential_share_would_leave_sampled_rooms_unstable(m: float, ticks: int) -> None:
    """Near m = 1 the lag is shorter than the period: e^(-dt / tau) would leave nothing of it."""
    lag = 1.001 * lag_needed(m, ticks * PERIOD)
    for fraction, stable in ((kept(lag, PERIOD), True), (math.exp(-PERIOD / lag), False)):
        # f~ <- share f~ - (1 - share) m f~(k - ticks)
        polynomial = [1.0, -fraction, *[0.0] * (ticks - 1)]
        polynomial[ticks] += (1.0 - fraction) * m
        assert (float(np.abs(np.roots(polynomial)).max()) < 1.0) is stable


@pytest.mark.parametrize("ticks", [1, 2, 3, 5, 10, 100, 1000])
def test_the_lag_that_the_theorem_asks_for_is_enough_for_every_sampled_coupling(ticks: int) -> None:
    """The condition of science 3.8, for `kept`, at the fastest x whose gain is above 1."""
    for m in 1.0 + np.geomspace(1e-9, 1e3, 500):
        fraction = kept(lag_needed(m, ticks * PERIOD), PERIOD)
        r = fraction / (1.0 - fraction)
        half = math.sqrt((m * m - 1.0) / (4.0 * r * (r + 1.0)))
        assert half < 1.0
        x = 2.0 * math.asin(half)
        assert (ticks - 0.5) * x + math.acos(math.cos(0.5 * x) / m) < math.pi
