"""Faults: the hand is let go, and force comes only after quiet periods."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic.vec import ZERO, Vec3, add, norm, scale, sub
from cohaptic_client.loop.safety import (
    FAULT_RELEASE_TIME,
    Mode,
    SafetyState,
)
from tests.client.loop.safety_cases import (
    LIMITS,
    PERIOD,
    PRESSED,
    ROUNDING,
    Period,
    counted,
    forces,
    play,
    pressing,
    smooth,
)
from tests.examples_of_laws import examples

NAN, INF = math.nan, math.inf


FAULTS = {
    "nan wanted": Period((NAN, 0.0, 0.0)),
    "inf wanted": Period((0.0, -INF, 0.0)),
    "nan velocity": Period(ZERO, (0.0, 0.0, NAN)),
    "inf velocity": Period(ZERO, (INF, 0.0, 0.0)),
    "too fast a hand": Period(ZERO, (0.0, 1.6, 0.0)),
    "a stall": Period(ZERO, dt=0.021),
}


# One more than the quotient, for its rounding.
RELEASE = math.ceil(FAULT_RELEASE_TIME / PERIOD) + 1


@pytest.mark.parametrize("fault", FAULTS.values(), ids=list(FAULTS))
@given(force=forces, then=forces)
@settings(max_examples=examples(20))
def test_a_fault_lets_the_hand_go_within_the_release_time_without_a_jerk(
    fault: Period, force: Vec3, then: Vec3
) -> None:
    """Along a smooth ramp, whatever the law asks for meanwhile."""
    before = pressing(force)
    wanted = force if fault.wanted == ZERO else fault.wanted
    seen = play(before, [fault._replace(wanted=wanted)] + [Period(then)] * RELEASE)
    # A stall is no longer than two periods, either.
    start = counted(fault) / FAULT_RELEASE_TIME
    for k, after in enumerate(seen[1:]):
        left = max(0.0, 1.0 - start - k * PERIOD / FAULT_RELEASE_TIME)
        assert norm(sub(after.force, scale(before.force, smooth(left)))) < ROUNDING
        assert (after.mode, after.scale, after.quiet) == (Mode.WAITING, 0.0, 0) or left == 0.0
        assert after.fault
    assert seen[-1].force == ZERO
    jerks = [norm(sub(add(a.force, c.force), scale(b.force, 2.0))) for a, b, c in triples(seen)]
    first = 2.0 if fault.dt > PERIOD else 1.0  # periods that its first step takes
    bend = 6.0 * norm(before.force) * (PERIOD / FAULT_RELEASE_TIME) ** 2
    assert max(jerks) <= first * first * bend + ROUNDING


def triples(seen: list[SafetyState]) -> list[tuple[SafetyState, SafetyState, SafetyState]]:
    return list(zip(seen, seen[1:], seen[2:], strict=False))


@pytest.mark.parametrize("again", FAULTS.values(), ids=list(FAULTS))
@given(st.integers(1, RELEASE - 5))
def test_a_fault_in_the_middle_of_a_release_does_not_begin_it_anew(
    again: Period, after: int
) -> None:
    first = [FAULTS["nan wanted"]] + [Period(ZERO)] * after
    once, twice = (
        play(pressing((6.0, 0.0, 0.0)), [*first, p])[-1]
        for p in (Period(ZERO, dt=again.dt if again.dt == PERIOD else 2.0 * PERIOD), again)
    )
    assert twice.force == once.force
    assert norm(twice.force) > 0.0
    assert (twice.left, twice.released) == (once.left, once.released)
    assert twice.fault != once.fault or again.wanted != ZERO  # the newest is named


@pytest.mark.parametrize(
    ("period", "words"),
    [
        (Period((NAN, 0.0, 0.0)), "the law asked for (nan, 0.0, 0.0) N"),
        (Period(ZERO, (0.0, 2.0, 0.0)), "the hand moved at 2.00 m/s, above 1.5 m/s"),
        (Period(ZERO, dt=0.05), "the loop stood still for 50 ms, above 20 ms"),
    ],
)
def test_a_fault_names_the_value_and_the_limit(period: Period, words: str) -> None:
    assert play(PRESSED, [period])[-1].fault == words


@given(st.floats(0.0, LIMITS.max_speed), st.floats(0.0, 0.999 * LIMITS.stall))
def test_what_is_within_the_limits_is_no_fault(speed: float, dt: float) -> None:
    after = play(PRESSED, [Period((1.0, 0.0, 0.0), (speed, 0.0, 0.0), dt=dt)])[-1]
    assert (after.mode, after.fault) == (Mode.ENGAGED, "")


@given(st.sampled_from(list(FAULTS.values())), st.lists(st.booleans(), max_size=20))
def test_after_a_fault_force_comes_only_after_quiet_periods_in_a_row(
    fault: Period, quiet: list[bool]
) -> None:
    loud: Vec3 = (2.0, 0.0, 0.0)
    # The periods of the release do not count, however quiet.
    state = play(pressing(loud), [fault])[-1]
    while state.left > 0.0:
        state = play(state, [Period(ZERO)])[-1]
    row, engaged = 0, False
    for is_quiet in quiet:
        state = play(state, [Period(ZERO if is_quiet else loud)])[-1]
        row = row + 1 if is_quiet else 0
        engaged = engaged or row >= LIMITS.engage_periods
        assert (state.mode is Mode.ENGAGED) == engaged
        assert bool(state.fault) == (not engaged)
        if not engaged:
            assert state.force == ZERO


def test_a_hand_deep_in_the_object_is_never_engaged() -> None:
    seen = play(SafetyState(), [Period((0.0, 0.0, 3.0))] * 5000)
    assert {state.force for state in seen} == {ZERO}
    assert seen[-1].mode is Mode.WAITING


def test_a_silent_server_never_engages() -> None:
    state = play(SafetyState(), [Period(ZERO, silent=True)] * 100)[-1]
    assert state.mode is Mode.WAITING
