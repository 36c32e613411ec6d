from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from cohaptic_ops.restarts import LASTING, LONGEST, Restarts


@given(st.integers(1, 2000))
def test_no_pause_is_longer_than_the_longest(ends: int) -> None:
    assert Restarts(in_a_row=ends).pause <= LONGEST


@given(st.integers(0, 50), st.floats(0.0, 1e6))
def test_who_was_there_for_long_begins_anew(ends: int, ready: float) -> None:
    after = Restarts(in_a_row=ends, count=ends).ended(ready, ready + 1.01 * LASTING)
    assert (after.pause, after.count) == (0.0, ends + 1)
    soon = Restarts(in_a_row=ends, count=ends).ended(ready, ready + 0.5 * LASTING)
    assert soon.in_a_row == ends + 1
