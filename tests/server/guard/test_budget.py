from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from cohaptic_server.guard.limits import FULL, Budget, spend, wait

budgets = st.builds(Budget, st.floats(0.1, 1e4), st.floats(1.0, 1e4))
moments = st.lists(st.floats(0.0, 1e3), min_size=1, max_size=60).map(sorted)


@given(budgets, moments, st.floats(0.01, 10.0))
def test_in_any_time_no_more_is_spent_than_the_burst_and_the_rate_of_that_time(
    budget: Budget, times: list[float], amount: float
) -> None:
    bucket, spent = FULL, [0.0]
    for now in times:
        left = spend(bucket, amount, budget, now)
        bucket = bucket if left is None else left
        spent.append(spent[-1] + (0.0 if left is None else amount))
    for first in range(len(times)):
        for last in range(first, len(times)):
            within = spent[last + 1] - spent[first]
            limit = budget.burst + budget.rate * (times[last] - times[first])
            assert within <= limit * (1.0 + 1e-6) + 1e-6


@given(budgets, st.integers(1, 200))
def test_who_keeps_to_the_rate_is_never_refused(budget: Budget, count: int) -> None:
    bucket = FULL
    for number in range(count):
        left = spend(bucket, 1.0, budget, number / budget.rate)
        assert left is not None
        bucket = left


@given(budgets, st.floats(-1e6, 1e6), st.floats(0.0, 1e6))
def test_a_clock_that_is_set_back_locks_nobody_out_until_it_is_where_it_was(
    budget: Budget, before: float, back: float
) -> None:
    bucket = spend(FULL, budget.burst, budget, before)
    assert bucket is not None
    now = before - back
    assert wait(bucket, 1.0, budget, now) <= (1.0 + 1e-3) / budget.rate + 1e-6
    if back * budget.rate > 0.1:
        assert spend(bucket, 1.0, budget, now) is not None


@given(budgets, st.floats(0.0, 1e6))
def test_a_clock_that_is_set_forward_gives_one_burst_and_no_more(
    budget: Budget, ahead: float
) -> None:
    bucket = spend(FULL, budget.burst, budget, 0.0)
    assert bucket is not None
    spent = spend(bucket, budget.burst, budget, ahead)
    assert spent is None or spend(spent, 0.01 * budget.burst, budget, ahead) is None


@given(budgets, st.floats(0.0, 1e3), st.integers(1, 50))
def test_after_the_wait_that_was_told_it_can_be_spent(
    budget: Budget, now: float, times: int
) -> None:
    bucket = FULL
    for _ in range(times):
        bucket = spend(bucket, 1.0, budget, now) or bucket
    later = now + wait(bucket, 1.0, budget, now)
    assert spend(bucket, 1.0, budget, later + 1e-9) is not None
