"""The playing time of what comes over a link: as late as it must be, never a jump."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.control.playout import (
    BEGINNING,
    FALL,
    FRACTION,
    LONGEST,
    RISE,
    WINDOW,
    Playout,
)

offsets = st.floats(-1e6, 1e6)  # of the two clocks
late = st.floats(0.0, LONGEST)
GAP = 1.0 / 60.0  # s


def heard(ages: list[float], gap: float = GAP) -> Playout:
    """The playout after messages of these ages, one each gap, when all of them have counted."""
    playout, now = Playout.begun(ages[0]).measured(ages[0], 0.0), BEGINNING
    for age in ages:
        now += gap
        playout = playout.measured(age, now).advanced(gap, age)
    return playout


@given(offsets, st.integers(1, 2000))
def test_a_link_that_does_not_waver_costs_nothing(offset: float, count: int) -> None:
    playout = heard([offset] * count)
    assert playout.behind == pytest.approx(playout.wanted)
    assert playout.wanted == offset
    assert playout.wavers == 0.0


@given(st.lists(st.tuples(st.floats(-0.2, 0.2), st.floats(0.0, 0.1)), min_size=1, max_size=200))
def test_the_playing_time_never_jumps_and_never_runs_back(
    messages: list[tuple[float, float]],
) -> None:
    """It stands still for want of a newer message, goes on from there and catches up."""
    playout, now, newest = Playout.begun(0.5), 0.0, -0.5
    for later, dt in messages:
        playing = now - playout.behind
        now += dt
        newest = max(newest, min(now, newest + dt + later))
        playout = playout.measured(now - newest, now).advanced(dt, now - newest)
        way = now - playout.behind - playing
        assert -1e-9 <= way <= (1.0 + FALL) * dt + 1e-9
        late = playout.behind >= playout.wanted + LONGEST - 1e-9
        assert now - playout.behind <= max(newest, playing) + 1e-9 or late
        if now - playout.behind < newest - 1e-9:
            assert way >= (1.0 - RISE) * dt - 1e-9


@given(offsets, st.lists(late, min_size=1, max_size=250))
def test_one_in_a_hundred_may_come_later(offset: float, lateness: list[float]) -> None:
    ages = [offset + each for each in lateness]
    playout = heard(ages, WINDOW / 300)
    later = sum(age > playout.wanted for age in ages)
    assert later <= FRACTION * len(ages)
    # And no more is waited for than that takes.
    assert playout.wanted in ages
    if playout.wanted > min(ages):
        assert sum(age >= playout.wanted for age in ages) > FRACTION * len(ages)


@given(late, late, st.integers(4, 40))
def test_who_becomes_late_is_waited_for_at_once_and_a_while(
    before: float, then: float, count: int
) -> None:
    """Four messages of 300 are more than one in a hundred."""
    usual, later = min(before, then), max(before, then)
    early = [usual] * 260
    assert heard([*early, *[later] * count]).wanted == later
    quiet = [usual] * math.ceil(2.0 * WINDOW / GAP + 2.0)
    assert heard([*early, *[later] * count, *quiet]).wanted == usual


@given(offsets, st.floats(0.0, 100.0))
def test_a_stall_is_not_waited_for(offset: float, stall: float) -> None:
    playout = heard([offset, *[offset + stall] * 20])
    assert playout.wanted == pytest.approx(offset + min(stall, LONGEST), abs=1e-9)


@given(st.floats(0.0, 100.0), st.floats(0.0, 1.0))
def test_what_came_late_once_is_not_waited_for_for_long(first: float, usual: float) -> None:
    """A first message that was held up, or the first one after a long stall."""
    playout, now = Playout.begun(usual + first), 0.0
    for _ in range(2):
        now += GAP
        playout = playout.measured(usual, now).advanced(GAP, usual)
    assert playout.behind <= usual + LONGEST + 1e-9
