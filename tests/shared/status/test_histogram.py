from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.status.quantiles import TIME_EDGES, Histogram


@given(st.lists(st.floats(0.0, 10.0), max_size=50))
def test_each_value_is_in_the_bucket_whose_edges_hold_it(values: list[float]) -> None:
    histogram = Histogram()
    for value in values:
        histogram.add(value)
    for i, edge in enumerate(TIME_EDGES):
        assert sum(histogram.counts[: i + 1]) == sum(value <= edge for value in values)
    assert sum(histogram.counts) == len(values)
    assert histogram.total == pytest.approx(sum(values))


def test_edges_rise_and_the_periods_of_usual_rates_are_among_them() -> None:
    assert list(TIME_EDGES) == sorted(set(TIME_EDGES))
    for hz in (200.0, 100.0, 60.0, 50.0, 30.0, 20.0):
        assert 1.0 / hz in TIME_EDGES
