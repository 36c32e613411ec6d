"""A trend is claimed where looks tell it, and at no other place."""

from __future__ import annotations

import numpy as np
import pytest

from trend import LEAST_LOOKS, trend

TIMES = np.linspace(0.0, 60.0, 13)


def test_a_line_has_its_own_growth() -> None:
    found = trend(TIMES.tolist(), (5.0 + 0.5 * TIMES).tolist())
    assert found.least == pytest.approx(30.0)
    assert found.limit == pytest.approx(30.0)
    assert found.verdict(29.0) == "grows"
    assert found.verdict(31.0) == "steady"


@pytest.mark.parametrize("growth", [0.0, 30.0])
def test_the_interval_holds_the_truth_as_often_as_it_says(growth: float) -> None:
    chance = np.random.default_rng(1)
    held = 0
    for _ in range(2000):
        looks = growth / 60.0 * TIMES + chance.normal(0.0, 10.0, len(TIMES))
        found = trend(TIMES.tolist(), looks.tolist())
        held += found.least <= growth <= found.limit
    assert 0.93 <= held / 2000 <= 0.97  # four standard deviations of 2,000 trials are 0.02


def test_looks_that_scatter_tell_nothing() -> None:
    scattered = [0.0, 500.0] * 6 + [0.0]
    assert trend(TIMES.tolist(), scattered).verdict(100.0) == "cannot be told"


def test_few_looks_are_no_trend() -> None:
    with pytest.raises(ValueError, match="too few"):
        trend(range(LEAST_LOOKS - 1), range(LEAST_LOOKS - 1))
