from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic_client.loop.safety import NOT_HELD
from cohaptic_client.news import (
    FAULT_NEWS,
    FaultNews,
    fault_in_words,
    is_real_time,
    scheduling_in_words,
)


@pytest.mark.parametrize(
    ("fault", "held", "heard", "words"),
    [
        ("why", True, True, "force off: why; press Enter, then lift off the object to go on"),
        ("why", True, False, "force off: why; nobody can press Enter here, so end this and start"),
        ("why", False, False, "force off: why; lift off the object to go on"),
        (NOT_HELD, False, True, "not held; hold it, and lift off the object to go on"),
    ],
)
def test_a_fault_is_told_with_what_ends_it(fault: str, held: bool, heard: bool, words: str) -> None:
    assert words in fault_in_words(fault, held=held, heard=heard)


@given(st.lists(st.tuples(st.floats(0.0, 1.0), st.sampled_from(["", "a", "b", "c"])), max_size=60))
def test_no_more_than_one_fault_is_told_in_its_time_and_none_that_stays_is_left_out(
    way: list[tuple[float, str]],
) -> None:
    news, now, reported = FaultNews(), 0.0, list[float]()
    for passed, fault in way:
        now += passed
        if news.is_new(fault, now):
            assert fault
            reported.append(now)
    assert all(b - a >= FAULT_NEWS for a, b in pairwise(reported))
    if any(fault for _, fault in way):
        assert reported
    # One that stays is told in the end, and once.
    later = [news.is_new("stays", now + k * FAULT_NEWS) for k in range(1, 5)]
    assert later == [True, False, False, False]


@pytest.mark.parametrize(
    ("scheduling", "well"),
    [
        ("real-time (SCHED_FIFO 5), memory locked", True),
        ("high priority class, 1 ms timer", True),
        ("normal, memory not locked (Operation not permitted)", False),
        ("nice -10", False),
    ],
)
def test_a_refusal_of_real_time_is_told_with_what_to_do(scheduling: str, well: bool) -> None:
    assert is_real_time(scheduling) is well
    assert ("cohaptic doctor" in scheduling_in_words(scheduling)) is not well
