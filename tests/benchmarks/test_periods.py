"""The figures of the benchmark of periods, of numbers that are known."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

import periods

PERIOD = 0.001  # s
lates = st.lists(st.floats(0.0, 0.05), min_size=1, max_size=50)


def test_a_period_that_was_left_out_is_as_late_as_it_would_have_begun() -> None:
    seen = periods.with_those_left_out([1e-5, 0.0032, 2e-5], PERIOD)
    assert seen == pytest.approx([1e-5, 2e-5, 0.0002, 0.0012, 0.0022, 0.0032])


@given(lates)
def test_the_worst_stays_the_worst_and_none_is_late_by_less_than_none(late: list[float]) -> None:
    seen = periods.with_those_left_out(late, PERIOD)
    assert seen[-1] == max(late)
    assert seen == sorted(seen)
    assert seen[0] > -1e-12
    assert len(seen) >= len(late)


@given(lates, st.floats(0.0, 1.0))
def test_a_quantile_is_a_value_which_its_share_does_not_exceed(late: list[float], q: float) -> None:
    value = periods.quantile(sorted(late), q)
    assert value in late
    assert sum(each <= value for each in late) >= q * len(late) - 1e-9
    assert sum(each < value for each in late) <= q * len(late)


@given(lates)
def test_each_period_is_counted_once(late: list[float]) -> None:
    counted = periods.histogram(late)
    assert sum(counted.values()) == len(late)
    assert counted["above"] == sum(each > 0.02 for each in late)
    assert counted["to_10_us"] == sum(each <= 1e-5 for each in late)
