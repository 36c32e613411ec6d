"""The rule of a missed tick, and when the machine is said not to keep up."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic_server.room.tick_schedule import (
    TOO_MANY,
    WINDOW,
    MissedTickMonitor,
    TickMeters,
    next_tick,
)

PERIOD = 1.0 / 64.0  # exact in binary
WINDOW_TICKS = round(WINDOW / PERIOD)


@given(st.integers(0, 1000), st.integers(-64, 3200).map(lambda k: k / 64))
def test_the_next_tick_is_due_within_a_period_and_none_is_counted_twice(
    due: int, late: float
) -> None:
    before = due * PERIOD
    now = before + PERIOD + late * PERIOD
    after, left_out = next_tick(before, now, PERIOD)
    assert after == before + (1 + left_out) * PERIOD
    assert left_out == (int(late) if late > 1.0 else 0)
    # It is not later than it must be, and starts less than a period after it was due.
    assert now - after <= PERIOD


@given(st.lists(st.floats(0.0, 5.0), min_size=1, max_size=40))
def test_every_period_has_one_tick_which_was_missed_or_not(costs: list[float]) -> None:
    """A world whose ticks take these times [periods] is played, and counted by hand."""
    meters = TickMeters()
    due, now = 0.0, 0.0
    by_hand = 0
    for cost in costs:
        due, left_out = next_tick(due, now, PERIOD)
        started = max(due, now)
        now = started + cost * PERIOD
        meters.leave_out(left_out)
        meters.add(due, started, now, PERIOD)
        by_hand += left_out + (now > due + PERIOD)
    assert meters.missed == by_hand
    assert meters.ticks == round(due / PERIOD)
    assert meters.left_out == meters.ticks - len(costs)
    assert meters.cost.largest == pytest.approx(max(costs) * PERIOD)


def lines(missed: list[int]) -> list[str]:
    """What is said over windows with so many missed ticks each."""
    monitor = MissedTickMonitor(PERIOD)
    said = [monitor.see(1, int(k < count)) for count in missed for k in range(WINDOW_TICKS)]
    return [line for line in said if line]


def test_a_machine_that_falls_behind_is_reported_once_and_so_is_its_return() -> None:
    many = math.ceil(TOO_MANY * WINDOW_TICKS)
    assert lines([0, many - 1, many, WINDOW_TICKS, 0, 0]) == [
        f"the machine cannot keep up: {many} of the last {WINDOW_TICKS} ticks were missed",
        f"the machine keeps up again: 0 of the last {WINDOW_TICKS} ticks were missed",
    ]


def test_a_halt_of_the_machine_is_not_slowness() -> None:
    monitor = MissedTickMonitor(PERIOD)
    assert monitor.see(10 * WINDOW_TICKS, 10 * WINDOW_TICKS) == ""
    assert [monitor.see(1, 0) for _ in range(WINDOW_TICKS)] == [""] * WINDOW_TICKS
