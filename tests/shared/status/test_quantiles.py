from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.status.quantiles import Tally


@given(st.lists(st.floats(1e-6, 10.0), min_size=1, max_size=300), st.floats(0.01, 1.0))
def test_a_quantile_is_right_to_the_width_of_a_bucket(values: list[float], q: float) -> None:
    tally = Tally()
    for value in values:
        tally.add(value)
    exact = float(np.quantile(values, q, method="inverted_cdf"))
    assert exact * 0.999 <= tally.quantile(q) <= exact * 1.1


def test_counts_mean_and_largest() -> None:
    tally = Tally()
    assert tally.quantile(0.5) == tally.mean == 0.0
    for value in (0.0, 1.0, 2.0):
        tally.add(value)
    assert tally.count == 3
    assert tally.mean == pytest.approx(1.0)
    assert tally.largest == 2.0


def test_an_absurd_value_is_counted_too() -> None:
    tally = Tally()
    tally.add(1e9)
    assert tally.quantile(1.0) > 400.0
