from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic.vec import ZERO, Vec3, dot, norm, scale, sub
from cohaptic_client.safety import Mode, SafetyLimits, SafetyState, guard
from tests.strategies import vectors

LIMITS = SafetyLimits()
PERIOD = 0.001  # s
ROUNDING = 1e-9  # N; forces of some newtons in doubles
PRESSED = SafetyState(Mode.ENGAGED, 1.0, ZERO, 4, 0.0)  # engaged in full, no force yet


class Period(NamedTuple):
    """What one period brings to the safety layer."""

    wanted: Vec3
    velocity: Vec3 = ZERO
    silent: bool = False
    dt: float = PERIOD


any_vector = st.tuples(st.floats(), st.floats(), st.floats())
forces = vectors(40.0)  # up to 35 N: several times what is allowed
periods = st.lists(
    st.builds(
        Period,
        wanted=st.one_of(vectors(0.2), vectors(5.0), forces, any_vector),
        velocity=st.one_of(st.just(ZERO), vectors(2.0), any_vector),
        silent=st.booleans(),
        dt=st.one_of(st.just(PERIOD), st.floats(0.0, 0.03)),
    ),
    max_size=12,
)
pressed = st.builds(
    SafetyState,
    mode=st.just(Mode.ENGAGED),
    scale=st.floats(0.0, 1.0),
    force=vectors(5.0),
    quiet=st.just(0),
    now=st.just(0.0),
    fault=st.just(""),
)
states = st.one_of(st.just(SafetyState()), pressed)
friendly = st.builds(
    Period,
    wanted=forces,
    velocity=st.just(ZERO),
    silent=st.booleans(),
    dt=st.floats(0.0, 0.9 * LIMITS.stall),
)


def play(
    state: SafetyState, periods: list[Period], limits: SafetyLimits = LIMITS
) -> list[SafetyState]:
    """Every state on the way, the first included."""
    now, seen = 0.0 if state.now is None else state.now, [state]
    for p in periods:
        now += p.dt
        state = guard(state, p.wanted, now=now, velocity=p.velocity, silent=p.silent, limits=limits)
        seen.append(state)
    return seen


def pressing(force: Vec3) -> SafetyState:
    """A hand that has been given `force` for long, or as much of it as it may get."""
    return replace(PRESSED, force=scale(force, min(1.0, LIMITS.max_force / (norm(force) or 1.0))))


def off_the_way_to_zero(after: Vec3, before: Vec3) -> float:
    """Distance of a force from the straight way that leads from the one before it to zero [N]."""
    size = dot(before, before)
    share = min(1.0, max(0.0, dot(after, before) / size)) if size > 0.0 else 0.0
    return norm(sub(after, scale(before, share)))


# Bounds


@given(states, periods, st.floats(5.0, 20.0))
def test_the_force_never_exceeds_its_limit_whatever_comes(
    state: SafetyState, periods: list[Period], max_force: float
) -> None:
    for after in play(state, periods, replace(LIMITS, max_force=max_force)):
        assert norm(after.force) <= max_force + ROUNDING
        assert 0.0 <= after.scale <= 1.0


@given(states, periods, st.floats(10.0, 5000.0))
def test_the_force_never_changes_faster_than_its_rate_but_on_the_way_to_zero(
    state: SafetyState, periods: list[Period], max_rate: float
) -> None:
    seen = play(state, periods, replace(LIMITS, max_rate=max_rate))
    for before, after, period in zip(seen, seen[1:], periods, strict=False):
        change = off_the_way_to_zero(after.force, before.force)
        assert change <= max_rate * period.dt * (1.0 + 1e-6) + ROUNDING


@given(st.floats(0.1, 10.0), st.floats(0.0, math.pi), st.floats(0.0, 1.0))
def test_a_force_that_turns_is_held_back_even_if_it_becomes_smaller(
    size: float, angle: float, share: float
) -> None:
    before = pressing((size, 0.0, 0.0))
    turned = scale((math.cos(angle), math.sin(angle), 0.0), share * size)
    after = play(before, [Period(turned)])[-1]
    assert off_the_way_to_zero(after.force, before.force) <= LIMITS.max_rate * PERIOD + ROUNDING
    # And no more than that.
    if off_the_way_to_zero(turned, before.force) <= LIMITS.max_rate * PERIOD:
        assert norm(sub(after.force, turned)) < ROUNDING


@given(forces.filter(lambda f: norm(f) < LIMITS.max_force), st.floats(0.0, 1.0))
def test_a_change_towards_zero_is_never_held_back(force: Vec3, share: float) -> None:
    before = pressing(force)
    assert norm(sub(before.force, force)) < ROUNDING
    after = play(before, [Period(scale(force, share))])[-1]
    assert norm(sub(after.force, scale(force, share))) < ROUNDING


@given(forces.filter(lambda f: norm(f) > LIMITS.max_force))
def test_a_force_that_is_too_large_keeps_its_direction(force: Vec3) -> None:
    given_force = play(PRESSED, [Period(force)] * 20)[-1].force
    assert norm(given_force) == pytest.approx(LIMITS.max_force)
    assert dot(given_force, force) == pytest.approx(norm(given_force) * norm(force))


def test_the_first_period_gives_no_force() -> None:
    first = replace(PRESSED, now=None)
    assert (
        guard(first, (1.0, 0.0, 0.0), now=5.0, velocity=ZERO, silent=False, limits=LIMITS).force
        == ZERO
    )


@given(states, periods)
@settings(max_examples=30)
def test_the_same_periods_give_the_same_forces(state: SafetyState, periods: list[Period]) -> None:
    # NaN in a sentence of a fault is text, so states compare.
    assert play(state, periods) == play(state, periods)


# Faults

NAN, INF = math.nan, math.inf
FAULTS = {
    "nan wanted": Period((NAN, 0.0, 0.0)),
    "inf wanted": Period((0.0, -INF, 0.0)),
    "nan velocity": Period(ZERO, (0.0, 0.0, NAN)),
    "inf velocity": Period(ZERO, (INF, 0.0, 0.0)),
    "too fast a hand": Period(ZERO, (0.0, 1.6, 0.0)),
    "a stall": Period(ZERO, dt=0.021),
}


@pytest.mark.parametrize("fault", FAULTS.values(), ids=list(FAULTS))
@given(force=forces)
@settings(max_examples=20)
def test_a_fault_means_zero_at_once_and_waiting(fault: Period, force: Vec3) -> None:
    before = pressing(force)
    wanted = force if fault.wanted == ZERO else fault.wanted
    after = play(before, [fault._replace(wanted=wanted)])[-1]
    assert after.force == ZERO
    assert (after.mode, after.scale, after.quiet) == (Mode.WAITING, 0.0, 0)
    assert after.fault


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
    state = play(pressing((2.0, 0.0, 0.0)), [fault])[-1]
    loud: Vec3 = (2.0, 0.0, 0.0)
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


# Fading and rising


@given(st.floats(0.05, 1.0), forces, st.floats(0.0005, 0.01))
@settings(max_examples=50)
def test_once_silent_the_force_is_exactly_zero_within_the_fade_time(
    start: float, force: Vec3, dt: float
) -> None:
    # A hundred-millionth of a period for the rounding of the sum of the periods.
    periods = math.ceil(LIMITS.fade_time / dt + 1e-8)
    state = replace(pressing(force), scale=start)
    seen = play(state, [Period(force, silent=True, dt=dt)] * (periods + 1))
    assert seen[periods + 1].force == ZERO
    sizes = [norm(s.force) for s in seen[1:]]
    assert sizes == sorted(sizes, reverse=True)
    steepest = norm(force) * dt / LIMITS.fade_time
    assert all(a - b <= steepest + ROUNDING for a, b in pairwise(sizes))


@given(st.integers(1, 250), forces.filter(lambda f: norm(f) > 0.5))
@settings(max_examples=30)  # a second of periods each
def test_when_the_server_is_heard_again_the_force_rises_smoothly(silent: int, force: Vec3) -> None:
    seen = play(pressing(force), [Period(force, silent=True)] * silent)
    low = seen[-1]
    periods = math.ceil((1.0 - low.scale) * LIMITS.engage_time / PERIOD + 1e-6)
    back = play(low, [Period(force)] * (periods + 1))
    full = min(norm(force), LIMITS.max_force)
    assert norm(back[-1].force) == pytest.approx(full)
    steepest = norm(force) * PERIOD / LIMITS.engage_time
    for before, after in pairwise(back):
        assert -ROUNDING <= norm(after.force) - norm(before.force) <= steepest + ROUNDING


def test_at_the_start_the_force_rises_over_the_engage_time() -> None:
    quiet = [Period(ZERO)] * LIMITS.engage_periods
    engaged = play(SafetyState(now=0.0), quiet)[-1]
    assert engaged.mode is Mode.ENGAGED
    press = [Period((3.0, 0.0, 0.0))] * round(LIMITS.engage_time / PERIOD)
    sizes = [norm(s.force) for s in play(engaged, press)]
    assert sizes[500] == pytest.approx(1.5, abs=0.01)  # half-way, to the first periods
    assert sizes[-1] == pytest.approx(3.0)


@given(st.lists(friendly, max_size=12))
@settings(max_examples=40)
def test_silence_alone_never_asks_the_hand_to_lift_off(periods: list[Period]) -> None:
    assert {state.mode for state in play(PRESSED, periods)} == {Mode.ENGAGED}
