from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic.vec import ZERO, Vec3, add, dot, norm, scale, sub
from cohaptic_client.loop.safety import (
    BACKSTOP,
    EXTERNAL_RATE,
    FAULT_RELEASE_TIME,
    LEAST_RATE,
    OWN_SPEED,
    SAFETY_FADE_RATE,
    Mode,
    SafetyState,
    next_fraction,
    rate_of,
    towards,
)
from tests.client.loop.safety_cases import (
    LIMITS,
    PERIOD,
    PRESSED,
    ROUNDING,
    Period,
    clamped,
    counted,
    forces,
    friendly,
    guard,
    periods,
    play,
    pressed,
    pressing,
    states,
)
from tests.examples_of_laws import examples
from tests.strategies import vectors


@given(states, periods, st.floats(5.0, 20.0))
def test_the_force_never_exceeds_its_limit_whatever_comes(
    state: SafetyState, periods: list[Period], max_force: float
) -> None:
    for after in play(state, periods, replace(LIMITS, max_force=max_force)):
        assert norm(after.force) <= max_force + ROUNDING
        assert 0.0 <= after.scale <= 1.0


@given(states, periods, st.floats(10.0, 5000.0))
def test_the_force_never_changes_faster_than_its_rate_up_or_down(
    state: SafetyState, periods: list[Period], max_rate: float
) -> None:
    """But while a hand is let go, which takes no longer for a larger force."""
    seen = play(state, periods, replace(LIMITS, max_rate=max_rate))
    for before, after, period in zip(seen, seen[1:], periods, strict=False):
        steepest = max_rate
        if after.released != ZERO:
            steepest = STEEPEST * norm(after.released) / FAULT_RELEASE_TIME
        change = norm(sub(after.force, before.force))
        assert change <= steepest * counted(period) * (1.0 + 1e-6) + ROUNDING


STEEPEST = 1.5  # of a smooth ramp, in the middle, times that of a straight one


@given(states, periods)
def test_what_a_usual_device_gives_is_let_go_no_faster_than_the_rate_either(
    state: SafetyState, periods: list[Period]
) -> None:
    seen = play(state, periods)
    for before, after, period in zip(seen, seen[1:], periods, strict=False):
        change = norm(sub(after.force, before.force))
        assert change <= LIMITS.max_rate * counted(period) * (1.0 + 1e-6) + ROUNDING


@given(forces, forces)
def test_a_force_goes_straight_to_the_one_that_is_wanted_as_fast_as_it_may(
    first: Vec3, second: Vec3
) -> None:
    """To a smaller one, too: a force that vanishes is as much of a jolt as one that comes."""
    before, target = pressing(first), clamped(second)
    way = sub(target, before.force)
    limit = LIMITS.max_rate * PERIOD
    expected = target
    if norm(way) > limit:
        expected = add(before.force, scale(way, limit / norm(way)))
    after = play(before, [Period(second)])[-1]
    assert norm(sub(after.force, expected)) < ROUNDING


@given(st.sampled_from([PRESSED, SafetyState(now=0.0, quiet=9)]) | pressed, friendly)
def test_a_late_period_moves_the_force_no_further_than_two_punctual_ones(
    state: SafetyState, period: Period
) -> None:
    late = period._replace(dt=max(period.dt, 2.0 * PERIOD))
    after, two = (play(state, [p])[-1] for p in (late, period._replace(dt=2.0 * PERIOD)))
    # What it remembers besides is how slowly to go on.
    assert after == replace(two, now=after.now, own=after.own, catch_up=after.catch_up)


@given(forces.filter(lambda f: norm(f) > LIMITS.max_force))
def test_a_force_that_is_too_large_keeps_its_direction(force: Vec3) -> None:
    given_force = play(PRESSED, [Period(force)] * 20)[-1].force
    assert norm(given_force) == pytest.approx(LIMITS.max_force)
    assert dot(given_force, force) == pytest.approx(norm(given_force) * norm(force))


@given(vectors(20.0), forces, st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_a_share_is_that_of_what_may_be_given(
    before: Vec3, wanted: Vec3, fraction: float, limit: float
) -> None:
    """Clamped first: a share of a force far beyond the limit is less than the limit, too."""
    state = replace(PRESSED, scale=fraction, force=before)
    limits = replace(LIMITS, max_rate=1e9)
    after = guard(state, wanted, now=PERIOD, velocity=ZERO, silent=True, limits=limits)
    assert norm(sub(after.force, scale(clamped(wanted), after.scale))) < ROUNDING
    held = towards(before, wanted, limit)
    assert norm(sub(held, before)) <= limit + ROUNDING
    assert towards(before, wanted, math.inf) == wanted


def test_the_first_period_gives_no_force() -> None:
    first = replace(PRESSED, now=None)
    assert (
        guard(first, (1.0, 0.0, 0.0), now=5.0, velocity=ZERO, silent=False, limits=LIMITS).force
        == ZERO
    )


@given(states, periods)
@settings(max_examples=examples(30))
def test_the_same_periods_give_the_same_forces(state: SafetyState, periods: list[Period]) -> None:
    # NaN in a sentence of a fault is text, so states compare.
    assert play(state, periods) == play(state, periods)


def whole(force: Vec3, time: float) -> float:
    """How long it takes for a force to come or go as a whole [s]."""
    return max(time, norm(clamped(force)) / SAFETY_FADE_RATE)


@given(st.floats(0.05, 1.0), forces, st.floats(0.0005, 0.01))
@settings(max_examples=examples(50))
def test_once_silent_the_force_is_exactly_zero_after_the_fade(
    start: float, force: Vec3, dt: float
) -> None:
    """Within its time, or as fast as a force may move that the hand does not; however much of it
    the law asks for beyond that.
    """
    step = min(dt, 2.0 * PERIOD)
    # A hundred-millionth of a period for the rounding of the sum of the periods.
    periods = math.ceil(start * whole(force, LIMITS.fade_time) / step + 1e-8)
    state = replace(PRESSED, force=scale(clamped(force), start), scale=start)
    seen = play(state, [Period(force, silent=True, dt=dt)] * (periods + 1))
    assert seen[periods + 1].force == ZERO
    sizes = [norm(s.force) for s in seen]
    steepest = norm(clamped(force)) * step / whole(force, LIMITS.fade_time)
    assert all(-ROUNDING <= a - b <= steepest + ROUNDING for a, b in pairwise(sizes))
    # And no sooner.
    assert norm(force) == 0.0 or sizes[periods - 2] > 0.0 or periods < 3


@given(st.floats(1.0, 1e5), st.floats(0.0, OWN_SPEED))
def test_a_hand_that_taps_meets_its_own_force(stiffness: float, speed: float) -> None:
    """On whatever its device renders: the rate holds back nothing that the hand itself causes."""
    limits = replace(LIMITS, max_force=1e6, max_rate=rate_of(stiffness))
    assert limits.max_rate >= LEAST_RATE
    force = 0.0
    state = PRESSED
    for _ in range(5):
        force += stiffness * speed * PERIOD
        state = play(state, [Period((0.0, 0.0, force))], limits)[-1]
        assert state.force[2] == pytest.approx(force, rel=1e-9)


@given(st.floats(0.021, 0.2), st.floats(0.0, 8.0), st.floats(0.0, 8.0))
def test_after_the_loop_stood_still_the_force_follows_as_slowly_as_the_hand_moved(
    stood: float, before: float, after: float
) -> None:
    """A pause of 87 ms was followed by 2 N in one period; the hand had taken 87 ms for its way."""
    limits = replace(LIMITS, stall=1.0)
    state, force, now = pressing((before, 0.0, 0.0)), (after, 0.0, 0.0), stood
    own = abs(after - before)
    late = guard(state, force, now=now, velocity=ZERO, silent=False, limits=limits, own=own)
    seen = [state, late]
    while now < 2.0 * stood + 0.01:
        now += PERIOD
        seen.append(
            guard(seen[-1], force, now=now, velocity=ZERO, silent=False, limits=limits, own=0.0)
        )
    steps = [norm(sub(b.force, a.force)) for a, b in pairwise(seen)]
    limit = (own / stood + BACKSTOP * EXTERNAL_RATE) * PERIOD
    # The late period counts as two.
    assert max(steps[1:]) <= limit + 1e-9
    assert steps[0] <= 2.0 * limit + 1e-9
    assert norm(sub(seen[-1].force, force)) < 1e-9
    assert seen[-1].catch_up == 0.0


@given(st.floats(0.021, 0.2), st.lists(st.floats(0.0, 0.5), min_size=80, max_size=80), forces)
def test_what_is_left_of_a_standstill_moves_a_force_by_no_more_than_it_was(
    stood: float, own: list[float], force: Vec3
) -> None:
    """Beyond the hand's own motion and what others may do, a patch gets nothing of it."""
    limits = replace(LIMITS, stall=1.0)
    state, now = pressing((3.0, 0.0, 0.0)), stood
    moved, model_change = 0.0, 0.0
    for k, way in enumerate([2.0, *own]):
        after = guard(state, force, now=now, velocity=ZERO, silent=False, limits=limits, own=way)
        moved += norm(sub(after.force, state.force))
        model_change += way + BACKSTOP * EXTERNAL_RATE * (2.0 if k == 0 else 1.0) * PERIOD
        assert moved <= model_change + 1e-9
        state, now = after, now + PERIOD


@given(st.floats(0.0, 1.0), st.booleans(), st.floats(0.0, 40.0), st.floats(0.001, 1.0))
def test_no_fade_moves_a_force_faster_than_others_may(
    fraction: float, up: bool, size: float, time: float
) -> None:
    after = next_fraction(fraction, up, size, time, PERIOD)
    assert 0.0 <= after <= 1.0
    assert abs(after - fraction) * size <= SAFETY_FADE_RATE * PERIOD * (1.0 + 1e-9)
    assert abs(after - fraction) <= PERIOD / time * (1.0 + 1e-9)
    assert (after >= fraction) if up else (after <= fraction)


@given(st.integers(1, 250), forces.filter(lambda f: norm(f) > 0.5))
@settings(max_examples=examples(30))  # a second of periods each
def test_when_the_server_is_heard_again_the_force_rises_smoothly(silent: int, force: Vec3) -> None:
    seen = play(pressing(force), [Period(force, silent=True)] * silent)
    low = seen[-1]
    periods = math.ceil((1.0 - low.scale) * whole(force, LIMITS.engage_time) / PERIOD + 1e-6)
    back = play(low, [Period(force)] * (periods + 1))
    full = norm(clamped(force))
    assert norm(back[-1].force) == pytest.approx(full)
    steepest = full * PERIOD / whole(force, LIMITS.engage_time)
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
@settings(max_examples=examples(40))
def test_silence_alone_never_asks_the_hand_to_lift_off(periods: list[Period]) -> None:
    assert {state.mode for state in play(PRESSED, periods)} == {Mode.ENGAGED}
