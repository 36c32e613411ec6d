"""The most users that hold: found within the precision, whatever the truth is, by few tries."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

import load_search


@given(
    st.integers(0, 2000), st.integers(1, 700), st.integers(1, 1000), st.sampled_from([0.02, 0.1])
)
def test_the_most_that_holds_is_between_the_two_answers(
    truth: int, start: int, limit: int, precision: float
) -> None:
    tried: list[int] = []

    def holds(users: int) -> bool:
        tried.append(users)
        return users <= truth

    low, high = load_search.most(holds, start, limit, precision)
    assert low <= truth
    assert all(1 <= users <= limit for users in tried)
    assert len(set(tried)) == len(tried) <= 40
    if high is None:
        assert low == limit
    else:
        assert truth < high
        assert high - low <= max(1, int(precision * low))
