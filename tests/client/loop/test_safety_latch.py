"""A fault that stays until the user acknowledges it, and a switch that has to be held."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.vec import ZERO, Vec3, norm
from cohaptic_client.loop.safety import NOT_HELD, Mode, SafetyState
from cohaptic_client.loop.state import LoopState
from tests.client.loop.safety_cases import LIMITS, PERIOD, Period, guard, play, pressing
from tests.client.loop.test_safety_faults import FAULTS, RELEASE

LATCHED = replace(LIMITS, latch=True)
SWITCHED = replace(LATCHED, dead_man=True)
FORCE: Vec3 = (0.0, 0.0, 6.0)
QUIET = [Period(ZERO)] * 10


def acknowledged(state: SafetyState) -> SafetyState:
    return LoopState(safety=state).acknowledged().safety


@pytest.mark.parametrize("fault", FAULTS.values(), ids=list(FAULTS))
def test_a_fault_keeps_the_force_off_until_it_is_acknowledged(fault: Period) -> None:
    seen = play(pressing(FORCE), [fault] + [Period(FORCE)] * RELEASE + QUIET * 500, LATCHED)
    assert {state.mode for state in seen[1:]} == {Mode.FAULT}
    assert seen[-1].force == ZERO
    assert seen[-1].fault
    word = acknowledged(seen[-1])
    assert (word.mode, word.fault) == (Mode.WAITING, seen[-1].fault)
    # And then only outside of the object.
    inside = play(word, [Period(FORCE)] * 100, LATCHED)[-1]
    assert (inside.mode, inside.force) == (Mode.WAITING, ZERO)
    outside = play(inside, QUIET, LATCHED)[-1]
    assert (outside.mode, outside.fault) == (Mode.ENGAGED, "")


def test_nothing_is_acknowledged_before_the_force_is_gone() -> None:
    falling = play(pressing(FORCE), [FAULTS["a stall"]], LATCHED)[-1]
    assert falling.left > 0.0
    assert acknowledged(falling) == falling


@given(st.sampled_from([SafetyState(), pressing(FORCE)]))
def test_there_is_nothing_to_acknowledge_without_a_fault(state: SafetyState) -> None:
    assert acknowledged(state) == state


def test_without_a_latch_a_fault_ends_when_the_hand_leaves_the_object() -> None:
    seen = play(pressing(FORCE), [FAULTS["a stall"]] + [Period(ZERO)] * RELEASE + QUIET)
    assert seen[-1].mode is Mode.ENGAGED


def periods(state: SafetyState, n: int, *, held: bool, speed: float = 0.0) -> SafetyState:
    for _ in range(n):
        now = (state.now or 0.0) + PERIOD
        state = guard(
            state, FORCE, now=now, velocity=(speed, 0.0, 0.0), silent=False, limits=SWITCHED,
            held=held,
        )  # fmt: skip
    return state


def test_a_switch_that_is_let_go_lets_the_hand_go_and_is_no_fault() -> None:
    dropped = periods(pressing(FORCE), RELEASE, held=False)
    assert (dropped.mode, dropped.force, dropped.fault) == (Mode.WAITING, ZERO, NOT_HELD)
    # What nobody holds may fall.
    fallen = periods(dropped, 100, held=False, speed=5.0)
    assert fallen.mode is Mode.WAITING
    again = periods(fallen, 100, held=True)
    assert (again.mode, again.force) == (Mode.WAITING, ZERO)  # it is inside
    assert play(again, QUIET, SWITCHED)[-1].mode is Mode.WAITING or norm(again.force) == 0.0


def test_a_latched_fault_does_not_go_by_the_switch() -> None:
    state = play(pressing(FORCE), [FAULTS["a stall"]] + [Period(ZERO)] * RELEASE, LATCHED)[-1]
    for held in (False, True, False, True):
        state = periods(state, 50, held=held)
        assert state.mode is Mode.FAULT
        assert "stood still" in state.fault


def test_a_fault_can_be_acknowledged_while_the_switch_is_not_held() -> None:
    """In whichever period the word comes: the release is over, and does not begin anew."""
    state = play(pressing(FORCE), [FAULTS["a stall"]] + [Period(ZERO)] * RELEASE, LATCHED)[-1]
    for n in range(2 * RELEASE):
        dropped = periods(state, n, held=False)
        assert (dropped.mode, dropped.force) == (Mode.FAULT, ZERO)
        word = acknowledged(dropped)
        assert word.mode is Mode.WAITING
        later = periods(word, 3 * RELEASE, held=False)
        assert (later.mode, later.force, later.fault) == (Mode.WAITING, ZERO, NOT_HELD)


def test_something_else_that_takes_the_force_away_leaves_none() -> None:
    before = LoopState(safety=pressing(FORCE))
    for limits, mode in ((LIMITS, Mode.WAITING), (LATCHED, Mode.FAULT)):
        after = before.taken_away("a fault", limits).safety
        assert (after.mode, after.force, after.fault) == (mode, ZERO, "a fault")
