"""The loop between hands that are modelled: where it is zero, where it is below 1, and its lag."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic_experiments.partner_models.ensemble import compliance, felt
from cohaptic_experiments.partner_models.loop_gain import loops, radius
from cohaptic_server.numeric import Floats
from cohaptic_server.world.partners.small_gain import (
    FREQUENCIES,
    GAIN,
    LAGS,
    Surroundings,
    lag,
    row,
    surroundings,
)

users = st.integers(2, 4)
seeds = st.integers(0, 1000)


def drawn(seed: int, n: int) -> tuple[Floats, Floats]:
    """Hands and models of one room, shape (1, n, 3) each."""
    rng = np.random.default_rng(seed)
    low, high = np.log((0.05, 1.0, 100.0)), np.log((0.5, 10.0, 1000.0))
    hands, models = (np.exp(low + (high - low) * rng.random((1, n, 3))) for _ in range(2))
    return hands, models


@given(seeds, users)
def test_nothing_loops_with_right_models(seed: int, n: int) -> None:
    hands, _ = drawn(seed, n)
    assert not loops(compliance(1, n), hands, hands, FREQUENCIES).any()


@given(seeds, users)
@settings(max_examples=30)
def test_without_delays_any_model_is_the_truth(seed: int, n: int) -> None:
    hands, models = drawn(seed, n)
    none = np.zeros((1, n))
    ratio = felt(compliance(1, n), hands, models, none, none)
    assert np.abs(ratio - 1.0).max() < 1e-9


@given(seeds, st.floats(0.55, 20.0))
def test_at_rest_a_model_may_be_half_as_stiff_or_stiffer(seed: int, stiffer: float) -> None:
    hands, _ = drawn(seed, 2)
    models = hands * (1.0, 1.0, stiffer)
    assert radius(loops(compliance(1, 2), hands, models, np.array([1e-3])))[0, 0] < 1.0


@given(seeds)
@settings(max_examples=30)
def test_a_lag_is_the_least_that_keeps_a_row_small(seed: int) -> None:
    hands, models = drawn(seed, 2)
    C = compliance(1, 2)
    around = surroundings(C, models, FREQUENCIES)
    each = Surroundings(around.compliance[0], around.fraction[0])
    clouds = hands[0][:, None] * np.ones((1, 5, 1))
    w = 2.0 * np.pi * FREQUENCIES
    rows = row(around, hands, models, FREQUENCIES)[0]
    for found, gain in zip(lag(each, clouds, models[0]).tolist(), rows, strict=True):
        place = LAGS.tolist().index(found)
        if found < LAGS[-1]:
            assert (gain / np.sqrt(1.0 + (w * found) ** 2)).max() < GAIN
        if place:
            assert (gain / np.sqrt(1.0 + (w * LAGS[place - 1]) ** 2)).max() >= GAIN
