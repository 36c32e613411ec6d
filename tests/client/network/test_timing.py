from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic_client.network.timing import WINDOW, LinkTiming

ways = st.floats(0.0, 0.5)
offsets = st.floats(-1e5, 1e5)


def passage(
    timing: LinkTiming, at: float, up: float, down: float, wait: float, offset: float
) -> LinkTiming:
    """A sample that leaves at `at` on the client's clock, and its patch."""
    tick = at + up + wait
    return timing.measured(t_client=at, t_server=tick + offset, sample_wait=wait, now=tick + down)


@given(ways, st.floats(0.0, 0.05), offsets)
def test_equal_ways_give_the_offset_and_the_wait_does_not_count(
    way: float, wait: float, offset: float
) -> None:
    timing = passage(LinkTiming(), 100.0, way, way, wait, offset)
    assert timing.round_trip == pytest.approx(2.0 * way, abs=1e-9)
    assert timing.clock_offset == pytest.approx(offset, abs=1e-9)


@given(st.lists(st.tuples(ways, ways), min_size=1, max_size=100), offsets)
def test_the_offset_is_never_further_off_than_its_bound(
    trips: list[tuple[float, float]], offset: float
) -> None:
    timing, at = LinkTiming(), 100.0
    for up, down in trips:
        timing = passage(timing, at, up, down, 0.005, offset)
        assert abs(timing.clock_offset - offset) <= timing.clock_error + 1e-9
        at += 0.02


def test_before_the_first_patch_nothing_is_known() -> None:
    timing = LinkTiming()
    assert (timing.round_trip, timing.clock_offset, timing.clock_error) == (0.0, 0.0, 0.0)


def test_a_clock_that_drifts_is_followed_within_two_windows() -> None:
    timing, drift = LinkTiming(), 1e-4
    for k in range(2000):
        at = 0.02 * k
        timing = passage(timing, at, 0.04, 0.04, 0.0, drift * at)
        assert abs(timing.clock_offset - drift * at) <= 2.0 * WINDOW * drift + 1e-9


@given(st.lists(st.floats(0.0, 0.02), min_size=400, max_size=400))
def test_mean_and_jitter_settle_within_what_was_seen(extra: list[float]) -> None:
    timing = LinkTiming()
    for k, more in enumerate(extra):
        timing = passage(timing, 0.02 * k, 0.05, 0.05 + more, 0.0, 0.0)
    assert 0.1 - 1e-9 <= timing.round_trip <= 0.12
    assert 0.0 <= timing.jitter <= 0.02
