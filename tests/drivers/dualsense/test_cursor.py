from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.vec import norm, sub
from cohaptic_drivers.dualsense.cursor import (
    FRONT,
    SPEED,
    TOP,
    Axes,
    Cursor,
    Room,
    moved,
    position,
    velocity,
)
from cohaptic_drivers.dualsense.reports import Held

ROOM = Room(FRONT, depth=0.03, reach=0.2)
REST = Held((0.0, 0.0), (0.0, 0.0), 0)
START = Cursor(base=-0.11)
PERIOD = 0.001  # s
MAX_SPEED = 1.5  # m/s, of the safety layer
fraction = st.floats(-1.0, 1.0)
stick = st.tuples(fraction, fraction)
held = st.builds(Held, stick, stick, st.integers(0, 255))
steps = st.lists(st.tuples(held, st.floats(0.0, 0.02), st.booleans()), max_size=30)


def going(hands: Held, seconds: float, start: Cursor = START, contact: bool = False) -> Cursor:
    cursor = start
    for _ in range(round(seconds / PERIOD)):
        cursor = moved(cursor, hands, PERIOD, ROOM, contact=contact)
    return cursor


@given(steps, st.sampled_from([FRONT, TOP]))
def test_the_tip_stays_in_its_room_and_is_as_fast_as_it_says(
    way: list[tuple[Held, float, bool]], axes: Axes
) -> None:
    room = Room(axes, ROOM.depth, ROOM.reach)
    cursor = START
    for hands, dt, contact in way:
        before = position(cursor, room.axes)
        cursor = moved(cursor, hands, dt, room, contact=contact)
        speed = norm(velocity(cursor, room.axes))
        assert speed < 0.5 * MAX_SPEED
        # At a wall it is cut off in the middle of a step, and no slower before it.
        assert norm(sub(position(cursor, room.axes), before)) <= 0.75 * dt + 1e-12
        assert abs(cursor.side) <= room.reach
        assert abs(cursor.up) <= room.reach
        assert -room.reach <= cursor.base <= 0.0
        assert -1e-12 <= cursor.press <= room.depth + 1e-12


@given(st.integers(0, 255), st.integers(0, 255))
def test_a_further_pull_presses_no_less(a: int, b: int) -> None:
    low, high = (going(Held((0.0, 0.0), (0.0, 0.0), pull), 0.2).press for pull in sorted((a, b)))
    assert low <= high + 1e-12


def test_the_trigger_goes_over_its_depth_inward_and_back() -> None:
    pulled = going(Held((0.0, 0.0), (0.0, 0.0), 255), 0.2)
    assert position(pulled, FRONT) == pytest.approx((0.0, -0.08, 0.0), abs=1e-6)
    assert position(pulled, TOP) == pytest.approx((0.0, 0.0, 0.08), abs=1e-6)
    assert position(going(REST, 0.2, pulled), FRONT) == pytest.approx((0.0, -0.11, 0.0), abs=1e-6)


def test_with_the_trigger_released_it_goes_back_off_the_object() -> None:
    forward = Held((0.0, 0.0), (0.0, 1.0), 0)
    back = going(forward, 0.1, contact=True)
    assert back.base == pytest.approx(-0.11 - 0.1 * SPEED)
    # And does not come in again before the stick was let go: no buzzing at the surface.
    assert going(forward, 0.1, back).base == back.base
    again = going(forward, 0.1, going(REST, 0.01, back))
    assert again.base > back.base


def test_a_quick_release_out_of_a_contact_leaves_the_way_of_the_trigger_where_it_was() -> None:
    pulled = going(Held((0.0, 0.0), (0.0, 0.0), 255), 0.2)
    leaving = going(REST, 0.02, pulled, contact=True)
    assert leaving.press > 0.01
    assert leaving.base == START.base


def test_the_stick_does_not_push_into_a_contact() -> None:
    pulled = Held((0.0, 0.0), (0.0, 1.0), 120)
    assert going(pulled, 0.1, contact=True).base == START.base
    away = Held((0.0, 0.0), (0.0, -1.0), 120)
    assert going(away, 0.1, contact=True).base < START.base
