from __future__ import annotations

import copy
import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import settings as examples
from hypothesis import strategies as st

from cohaptic.control.geometry import Sight
from cohaptic.control.law import NO_FORCE, Law
from cohaptic.protocol.patch import Patch
from cohaptic.vec import ZERO, Vec3, norm, scale, sub
from cohaptic_client.devices.device import DeviceSample
from cohaptic_client.safety import Mode, SafetyLimits, SafetyState
from cohaptic_client.step import (
    GAIN_RATE,
    LoopSettings,
    LoopState,
    Output,
    flat_surface,
    receive,
    shown,
    slew_gain,
    step,
)
from tests.client.plane import PLANE
from tests.strategies import counts, normals, patches, vectors

PERIOD = 0.001  # s
TICK = 1.0 / 60.0  # s
ROUNDING = 1e-9  # relative; doubles
SETTINGS = LoopSettings(TICK, SafetyLimits())
# So that what the law asks for is what is given; with the passivity layer and without.
WIDE = [
    LoopSettings(TICK, SafetyLimits(max_force=1e4, max_rate=1e9), max_damping=b) for b in (0.0, 8.0)
]

# Surfaces of a body within reach, and probes near them: forces, not only faults.
near_patches = st.builds(
    replace,
    st.just(PLANE),
    x_free=vectors(0.05),
    normal=normals,
    curvature=st.floats(-20.0, 20.0),
    law=st.sampled_from(Law),
    k_h=st.floats(1.0, 1000.0),
    integral_gain=st.floats(0.0, 5000.0),
    own_force=st.floats(0.0, 10.0),
    u_others=st.floats(-0.02, 0.02),
)
probes = vectors(0.1)
samples = st.builds(DeviceSample, position=probes, velocity=vectors(1.0), level=st.just(0.0))


def at(position: Vec3) -> DeviceSample:
    return DeviceSample(position, ZERO)


def engaged(patch: Patch, settings: LoopSettings = SETTINGS, now: float = 10.0) -> LoopState:
    """A loop that got its first patch one tick ago, on a hand that is engaged in full."""
    safety = SafetyState(Mode.ENGAGED, 1.0, ZERO, 4, now - PERIOD)
    return replace(receive(LoopState(), patch, now - TICK, settings), safety=safety)


def play(
    state: LoopState, samples: list[DeviceSample], settings: LoopSettings, now: float
) -> tuple[LoopState, list[Output]]:
    outputs = list[Output]()
    for sample in samples:
        state, output = step(state, sample, now, settings)
        outputs.append(output)
        now += PERIOD
    return state, outputs


# Pure


@given(near_patches, st.lists(samples, min_size=1, max_size=5), st.sampled_from(WIDE))
def test_the_same_inputs_give_the_same_outputs_and_the_state_stays_as_it_was(
    patch: Patch, samples: list[DeviceSample], settings: LoopSettings
) -> None:
    state = engaged(patch, settings)
    kept = copy.deepcopy(state)
    first = play(state, samples, settings, 10.0)
    assert play(state, samples, settings, 10.0) == first
    assert state == kept


def test_before_the_first_patch_there_is_no_force_and_the_server_counts_as_silent() -> None:
    state, outputs = play(LoopState(), [at((0.0, 0.0, -0.05))] * 100, SETTINGS, 10.0)
    assert set(outputs) == {Output(ZERO, ZERO, NO_FORCE, 0.0, 0.0, True)}
    assert shown(state, ZERO, 10.0, SETTINGS) is None


# Patches


@given(st.lists(st.tuples(counts, st.floats(0.0, 0.9)), min_size=1, max_size=20))
def test_an_older_patch_never_replaces_a_newer_one(arrivals: list[tuple[int, float]]) -> None:
    state, now, newest = LoopState(), 10.0, 0
    for tick, wait in arrivals:
        now += wait * SETTINGS.limits.silent_after
        after = receive(state, replace(PLANE, tick=tick), now, SETTINGS)
        if tick <= newest:
            assert after is state
        newest = max(newest, tick)
        assert after.patch is not None
        assert after.patch.tick == newest
        # Time since a patch that counted: what is left out must not keep the server alive.
        state, now = after, after.arrived


def test_a_server_that_comes_back_may_count_its_ticks_anew() -> None:
    """It was restarted; its first patches have lower numbers than those of the one before."""
    state = receive(LoopState(), replace(PLANE, tick=5000), 10.0, SETTINGS)
    back = 10.0 + SETTINGS.limits.silent_after + PERIOD
    again = receive(state, replace(PLANE, tick=1), back, SETTINGS)
    assert again.patch is not None
    assert again.patch.tick == 1
    _, output = step(again, at(ZERO), back, SETTINGS)
    assert not output.silent


@given(near_patches, near_patches, near_patches, st.floats(0.0, 1.0), probes, probes)
def test_a_new_patch_never_moves_the_force_in_the_period_of_its_arrival(
    first: Patch, second: Patch, other: Patch, share: float, last: Vec3, probe: Vec3
) -> None:
    """Whatever it says of surface and gain: that period's force is the same for any two of them."""
    second, other = (
        replace(p, law=first.law, integral_gain=first.integral_gain) for p in (second, other)
    )
    for settings in WIDE:
        state, _ = step(engaged(first, settings), at(last), 10.0, settings)
        now = 10.0 + share * TICK
        seen = {
            step(receive(state, patch, now, settings), at(probe), now, settings)[1].force
            for patch in (replace(second, tick=2), replace(other, tick=2))
        }
        assert len(seen) == 1


@given(near_patches, near_patches, probes, st.sampled_from(WIDE))
def test_with_and_without_a_new_patch_a_period_differs_by_the_change_of_a_gain(
    first: Patch, second: Patch, probe: Vec3, settings: LoopSettings
) -> None:
    second = replace(second, law=first.law, integral_gain=first.integral_gain)
    state = receive(engaged(first, settings), replace(second, tick=2), 10.0, settings)
    state, _ = step(state, at(probe), 10.0, settings)
    now = 10.0 + PERIOD
    newer = receive(state, replace(first, tick=3), now, settings)
    without, with_it = (norm(step(s, at(probe), now, settings)[1].force) for s in (state, newer))
    assert abs(with_it - without) <= (math.exp(GAIN_RATE * PERIOD) - 1.0) * without + ROUNDING


@given(near_patches, near_patches, probes, st.sampled_from(WIDE))
def test_within_a_simulation_period_the_surface_goes_over_to_the_new_patch(
    first: Patch, second: Patch, probe: Vec3, settings: LoopSettings
) -> None:
    state, _ = step(engaged(first, settings), at(probe), 10.0 - PERIOD, settings)
    state = receive(state, replace(second, tick=2), 10.0, settings)
    before, after = (flat_surface(patch).look(probe) for patch in (first, second))
    at_once = shown(state, probe, 10.0, settings)
    assert at_once is not None
    assert close(at_once, before)
    assert shown(state, probe, 10.0 + 1.001 * TICK, settings) == after
    half = shown(state, probe, 10.0 + 0.5 * TICK, settings)
    assert half is not None
    assert half.depth == pytest.approx(0.5 * (before.depth + after.depth), abs=ROUNDING)


@given(near_patches, near_patches, near_patches, probes, st.floats(0.1, 0.9))
def test_a_patch_that_comes_early_starts_from_what_was_shown(
    first: Patch, second: Patch, third: Patch, probe: Vec3, share: float
) -> None:
    """Jitter bunches patches: the way to the one before is then not over yet."""
    state, _ = step(engaged(first), at(probe), 10.0, SETTINGS)
    state = receive(state, replace(second, tick=2), 10.0, SETTINGS)
    now = 10.0 + share * TICK
    state, _ = step(state, at(probe), now, SETTINGS)
    before = shown(state, probe, now, SETTINGS)
    after = shown(receive(state, replace(third, tick=3), now, SETTINGS), probe, now, SETTINGS)
    assert before is not None
    assert after is not None
    assert close(before, after)


def close(a: Sight, b: Sight) -> bool:
    gaps = [abs(x - y) for x, y in zip((a.depth, *a.normal), (b.depth, *b.normal), strict=True)]
    # Normals come from 32 bits: their length is one to 1e-7.
    return max(gaps) < 1e-7 and abs(a.own_force - b.own_force) < ROUNDING


@given(near_patches, near_patches, probes)
def test_without_smoothing_a_patch_holds_from_its_arrival(
    first: Patch, second: Patch, probe: Vec3
) -> None:
    """The paper's zero-order hold."""
    held = replace(SETTINGS, smoothing=0.0)
    state = receive(engaged(first, held), replace(second, tick=2), 10.0, held)
    assert shown(state, probe, 10.0, held) == flat_surface(second).look(probe)


@given(patches, probes)
def test_the_first_patch_is_shown_at_once(patch: Patch, probe: Vec3) -> None:
    state = receive(LoopState(), patch, 10.0, SETTINGS)
    assert shown(state, probe, 10.0, SETTINGS) == flat_surface(patch).look(probe)
    assert (state.law, state.k_h) == (patch.law, patch.k_h)


@pytest.mark.parametrize(("age", "silent"), [(0.0, False), (0.0999, False), (0.1001, True)])
def test_a_server_is_silent_when_its_newest_patch_is_too_old(age: float, silent: bool) -> None:
    state = receive(LoopState(), PLANE, 0.0, SETTINGS)
    assert step(state, at(ZERO), age, SETTINGS)[1].silent is silent


# Gains

gains = st.floats(0.1, 1e5)


@given(gains, gains, st.floats(0.0, 0.01))
def test_a_gain_moves_by_one_percent_per_millisecond_at_most(
    k_h: float, target: float, dt: float
) -> None:
    moved = slew_gain(k_h, target, dt)
    assert abs(math.log(moved / k_h)) <= GAIN_RATE * dt + ROUNDING
    assert min(k_h, target) * (1 - ROUNDING) <= moved <= max(k_h, target) * (1 + ROUNDING)


@given(gains, gains)
def test_a_gain_reaches_its_target(k_h: float, target: float) -> None:
    periods = math.ceil(abs(math.log(target / k_h)) / (GAIN_RATE * PERIOD)) + 1
    for _ in range(periods):
        k_h = slew_gain(k_h, target, PERIOD)
    assert k_h == target


@given(st.lists(st.tuples(near_patches, st.integers(0, 30)), min_size=1, max_size=4))
@examples(max_examples=50)
def test_no_patch_moves_the_gain_faster_than_that(arrivals: list[tuple[Patch, int]]) -> None:
    state, now = engaged(PLANE), 10.0
    for tick, (patch, periods) in enumerate(arrivals, start=2):
        state = receive(state, replace(patch, tick=tick), now, SETTINGS)
        for _ in range(periods):
            before = state.k_h
            state, _ = step(state, at(ZERO), now, SETTINGS)
            assert abs(math.log(state.k_h / before)) <= GAIN_RATE * PERIOD + ROUNDING
            now += PERIOD


# Force


@given(near_patches, probes, st.sampled_from(WIDE))
def test_the_force_is_along_the_normal_and_only_pushes(
    patch: Patch, probe: Vec3, settings: LoopSettings
) -> None:
    flat = replace(patch, curvature=0.0)
    _, output = step(engaged(flat, settings), at(probe), 10.0, settings)
    expected = scale(flat.normal, output.local.normal_force)
    assert output.local.normal_force >= 0.0
    if norm(expected) < settings.limits.max_force:
        assert norm(sub(output.force, expected)) <= ROUNDING * (1.0 + norm(expected))


def test_a_hand_that_comes_from_outside_feels_the_spring_after_the_engage_time() -> None:
    outside, inside = at((0.0, 0.0, 0.01)), at((0.0, 0.0, -0.004))
    state, forces = LoopState(), list[Vec3]()
    for period in range(1300):
        now = 10.0 + period * PERIOD
        if period % 16 == 0:
            state = receive(state, replace(PLANE, tick=1 + period), now, SETTINGS)
        state, output = step(state, outside if period < 100 else inside, now, SETTINGS)
        forces.append(output.force)
    assert set(forces[:100]) == {ZERO}
    assert forces[-1] == pytest.approx((0.0, 0.0, 250.0 * 0.004))


def test_a_hand_that_was_inside_from_the_start_gets_no_force() -> None:
    state = receive(LoopState(), PLANE, 10.0, SETTINGS)
    _, outputs = play(state, [at((0.0, 0.0, -0.01))] * 90, SETTINGS, 10.0)
    assert {output.force for output in outputs} == {ZERO}
    assert outputs[-1].local.normal_force == pytest.approx(2.5)


# Laws


@given(near_patches, near_patches, probes, st.sampled_from(WIDE), st.integers(0, 400))
@examples(max_examples=60, deadline=None)
def test_a_change_of_law_moves_the_force_by_two_percent_a_period_at_most(
    first: Patch, second: Patch, probe: Vec3, settings: LoopSettings, later: int
) -> None:
    """Surface and hand at rest: what moves is the law, its gain and its integral."""
    second = replace(first, law=second.law, k_h=second.k_h, integral_gain=0.0)
    first = replace(first, integral_gain=0.0)
    state, now = engaged(first, settings), 10.0
    before = None
    for k in range(1000):
        if k % 16 == 0:
            patch = first if k < later else second
            state = receive(state, replace(patch, tick=k + 2), now, settings)
        state, output = step(state, at(probe), now, settings)
        force = output.local.normal_force
        if before is not None and (before > LEAST or force > LEAST):
            assert abs(force - before) <= 0.02 * max(before, force) + ROUNDING
        before, now = force, now + PERIOD
    assert state.law is second.law
    assert state.fade is not None


LEAST = 0.05  # N


@pytest.mark.parametrize("law", Law)
def test_a_change_of_law_ends(law: Law) -> None:
    state, now = engaged(PLANE), 10.0
    for k in range(2000):
        if k % 16 == 0:
            patch = replace(PLANE, tick=k + 2, law=law, k_h=75.0)
            state = receive(state, patch, now, SETTINGS)
        state, _ = step(state, at((0.0, 0.0, -0.01)), now, SETTINGS)
        now += PERIOD
    assert state.fade is not None
    assert (state.fade.now.law, state.fade.before) == (law, None)
    assert state.k_h == pytest.approx(75.0)
