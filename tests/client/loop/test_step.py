from __future__ import annotations

import copy
import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import settings as examples
from hypothesis import strategies as st

from cohaptic.control.friction import Compliance3
from cohaptic.control.geometry import Sight
from cohaptic.control.law import NO_FORCE, Law
from cohaptic.protocol.patch import Patch
from cohaptic.vec import ZERO, Vec3, add, norm, scale, sub
from cohaptic_client.devices.device import DeviceSample
from cohaptic_client.loop.passivity import Passivity
from cohaptic_client.loop.safety import EXTERNAL_RATE, Mode, SafetyLimits, SafetyState
from cohaptic_client.loop.slew import GAIN_RATE
from cohaptic_client.loop.step import (
    FORGET_GAPS,
    LONGEST_PATIENCE,
    MOST_CHANGE,
    PATIENCE,
    LoopSettings,
    LoopState,
    Output,
    flat_surface,
    gains_under,
    next_patience,
    receive,
    shown,
    step,
)
from tests.client.plane import PLANE, STIFFNESS
from tests.strategies import counts, normals, patches, single, vectors

PERIOD = 0.001  # s
TICK = 1.0 / 60.0  # s
ROUNDING = 1e-9  # relative; doubles
PACE = EXTERNAL_RATE * PERIOD  # N
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
    own_force=vectors(10.0),
    u_others=vectors(0.02),
)
probes = vectors(0.1)
# Softer along y than along x; pressing moves the contact along.
ROUGH = replace(PLANE, compliance=Compliance3(0.003, 0.005, 1.0 / STIFFNESS, 1e-3, 1e-3, -1e-3))
samples = st.builds(DeviceSample, position=probes, velocity=vectors(1.0), level=st.just(0.0))


def at(position: Vec3) -> DeviceSample:
    return DeviceSample(position, ZERO)


def engaged(patch: Patch, settings: LoopSettings = SETTINGS, now: float = 10.0) -> LoopState:
    """A loop that got its first patch one tick ago, on a hand that is engaged in full."""
    safety = SafetyState(Mode.ENGAGED, 1.0, ZERO, 4, now - PERIOD)
    return receive(LoopState(), patch, now - TICK, settings)._replace(safety=safety)


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
    after, with_it = (step(s, at(probe), now, settings) for s in (state, newer))
    # Where the surface is held back, a change of gain leaves it so much less way.
    force = norm(after[1].force)
    known = 2.0 * (max(force, after[0].k_h * after[0].depth) + PACE)
    change = abs(norm(with_it[1].force) - force)
    assert change <= (math.exp(GAIN_RATE * PERIOD) - 1.0) * known + ROUNDING


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
    return max(gaps) < 1e-7 and norm(sub(a.own_force, b.own_force)) < ROUNDING


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


# Patience

gaps = st.lists(st.floats(0.001, 2.0), min_size=1, max_size=8)


@given(gaps, st.floats(0.0, 2.0))
def test_a_silence_as_long_as_the_link_has_had_one_of_late_is_no_end(
    gaps: list[float], wait: float
) -> None:
    """One that is longer still is; on a punctual link it takes what the settings say. An outage
    says nothing of the link's way.
    """
    state, now = receive(LoopState(), PLANE, 10.0, SETTINGS), 10.0
    for tick, gap in enumerate(gaps, start=2):
        now += gap
        state = receive(state, replace(PLANE, tick=tick), now, SETTINGS)
    bearable = max(
        min(LONGEST_PATIENCE, PATIENCE * gap) * math.exp(-sum(gaps[i + 1 :]) / FORGET_GAPS)
        if gap <= LONGEST_PATIENCE
        else 0.0
        for i, gap in enumerate(gaps)
    )
    longest = max(SETTINGS.limits.silent_after, bearable)
    assert state.patience == pytest.approx(bearable, rel=1e-6, abs=1e-9)
    if abs(wait - longest) > 1e-6:
        assert step(state, at(ZERO), now + wait, SETTINGS)[1].silent is (wait > longest)


@given(st.floats(0.0, LONGEST_PATIENCE), st.floats(0.0, 100.0))
def test_patience_is_bounded_and_forgets(patience: float, gap: float) -> None:
    after = next_patience(patience, gap)
    kept = patience * math.exp(-gap / FORGET_GAPS)
    assert kept <= after <= LONGEST_PATIENCE
    if gap <= LONGEST_PATIENCE:
        assert after >= min(LONGEST_PATIENCE, PATIENCE * gap)
    if gap > LONGEST_PATIENCE or after > PATIENCE * gap:
        assert after == pytest.approx(kept)


def test_while_it_is_patient_the_force_stays_and_what_an_older_server_says_is_left_out() -> None:
    inside = at((0.0, 0.0, -0.01))
    state, now = engaged(PLANE), 10.0
    forces = list[float]()
    for k in range(800):
        if k % 16 == 0 and not (200 <= k < 500 or 560 <= k < 780):
            state = receive(state, replace(PLANE, tick=k + 2), now, SETTINGS)
        state, output = step(state, inside, now, SETTINGS)
        forces.append(output.force[2])
        now += PERIOD
    # The first silence fades the force, the second is shorter than the first.
    assert min(forces[300:500]) < 0.5 * forces[200]
    assert min(forces[700:780]) >= forces[560]
    assert receive(state, replace(PLANE, tick=1), now, SETTINGS) is state


# Gains

gains = st.floats(0.1, 1e5)


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


sights = st.builds(
    Sight, st.floats(-0.02, 0.02), normals, st.floats(1e-8, 1.0), vectors(5.0), vectors(0.02)
)


@given(near_patches, sights, st.floats(1e-4, 0.1), st.floats(10.0, 1e4))
def test_a_hand_has_the_objects_own_stiffness_where_it_is_or_the_devices(
    patch: Patch, sight: Sight, c_ii: float, limit: float
) -> None:
    """Nothing restores what a device takes, and no neighbour takes any (science 3.8)."""
    settings = replace(SETTINGS, max_stiffness=limit)
    predictive = replace(patch, law=Law.PREDICTIVE, c_ii=c_ii)
    here = min(max(sight.c_ii, c_ii / MOST_CHANGE), c_ii * MOST_CHANGE)
    # The server said the object's own, as 32 bits have it; or that the device is the softer.
    own = replace(predictive, k_h=single(1.0 / c_ii))
    assert gains_under(own, sight, settings).k_h == pytest.approx(min(1.0 / here, limit))
    soft = replace(predictive, k_h=min(0.9 / c_ii, limit))
    assert gains_under(soft, sight, settings).k_h == pytest.approx(min(1.0 / here, soft.k_h))


@given(near_patches, sights, st.floats(10.0, 1e4))
def test_gains_that_a_user_has_fixed_follow_nothing(
    patch: Patch, sight: Sight, limit: float
) -> None:
    settings = replace(SETTINGS, follow=False, max_stiffness=limit)
    found = gains_under(patch, sight, settings)
    assert found == (min(patch.k_h, limit), patch.integral_gain)


# What others do

depths = st.floats(-0.05, 0.05)


@given(
    st.lists(st.tuples(near_patches, st.integers(0, 20)), min_size=1, max_size=6),
    st.floats(-0.01, 0.02),
    st.sampled_from([0.0, 1.0]),
    st.sampled_from([0.0, 8.0]),
)
@examples(max_examples=100, deadline=None)
def test_a_hand_at_rest_is_moved_no_faster_than_others_may_move_it(
    arrivals: list[tuple[Patch, int]], depth: float, smoothing: float, damping: float
) -> None:
    """Whatever surfaces, stiffnesses and forces of its own the server says, held or in a line."""
    settings = replace(SETTINGS, smoothing=smoothing, max_damping=damping)
    state, now = engaged(PLANE, settings), 10.0
    before: Output | None = None
    for tick, (patch, periods) in enumerate(arrivals, start=2):
        patch = replace(patch, tick=tick, law=Law.PREDICTIVE, c_ii=1.0 / patch.k_h)
        state = receive(state, patch, now, settings)
        for _ in range(periods):
            state, output = step(state, at((0.0, 0.0, -depth)), now, settings)
            if before is not None:
                change = abs(output.local.normal_force - before.local.normal_force)
                assert change <= PACE * (1.0 + SECOND_ORDER)
            before, now = output, now + PERIOD


SECOND_ORDER = 0.01  # a change of gain times one of depth, relative


@given(
    st.lists(st.tuples(near_patches, st.integers(0, 20), st.booleans()), min_size=1, max_size=6),
    st.floats(-0.01, 0.02),
    st.floats(0.0, 1.0),
    st.sampled_from([0.0, 0.5]),
)
@examples(max_examples=100, deadline=None)
def test_fades_of_the_safety_layer_and_friction_are_part_of_that(
    arrivals: list[tuple[Patch, int, bool]], depth: float, share: float, friction: float
) -> None:
    """What the device gets, all in all, while the server falls silent and comes back.

    A friction force that the normal one moves counts twice: a tenth of it all on this contact.
    """
    most = PACE * (1.0 + (0.1 if friction > 0.0 else SECOND_ORDER))
    settings = replace(WIDE[0], friction=friction)
    patch = replace(PLANE, compliance=ROUGH.compliance if friction > 0.0 else None)
    tip, now = at((0.0, 0.0, -depth)), 10.0
    state = engaged(patch, settings)
    for _ in range(60):  # until friction and normal force agree
        state, _ = step(state, tip, now, settings)
        now += PERIOD
    now -= PERIOD
    force = scale(state.safety.force, share)
    state = state._replace(safety=state.safety._replace(scale=share, force=force))
    for tick, (other, periods, silent) in enumerate(arrivals, start=2):
        patch = replace(
            patch, tick=tick, x_free=(0.0, 0.0, other.x_free[2]), u_others=other.u_others
        )
        state = receive(state, patch, now, settings)
        if silent:
            state = state._replace(arrived=-math.inf)
        for _ in range(periods):
            before, now = state.safety.force, now + PERIOD
            state, output = step(state, tip, now, settings)
            assert norm(sub(output.force, before)) <= most


@given(st.floats(0.001, 0.02), st.floats(-0.02, 0.02), st.floats(0.0, 0.019))
def test_a_late_period_lets_others_move_a_hand_no_further_than_two_punctual_ones(
    depth: float, lift: float, late: float
) -> None:
    held = replace(SETTINGS, smoothing=0.0)
    state, _ = step(engaged(PLANE, held), at((0.0, 0.0, -depth)), 10.0, held)
    lifted = replace(PLANE, tick=2, x_free=(0.0, 0.0, lift))
    state = receive(state, lifted, 10.0, held)
    _, output = step(state, at((0.0, 0.0, -depth)), 10.0 + late, held)
    pace = EXTERNAL_RATE * min(late, 2.0 * PERIOD)
    change = output.local.normal_force - STIFFNESS * depth
    shown_force = STIFFNESS * max(0.0, depth + lift)
    expected = min(max(shown_force - STIFFNESS * depth, -pace), pace)
    assert change == pytest.approx(expected, abs=1e-9)


@given(st.lists(st.floats(-0.0014, 0.0014), min_size=1, max_size=60))
def test_the_hands_own_way_is_never_held_back(ways: list[float]) -> None:
    """Up to the speed at which it is let go: f = K d at once, in and out."""
    state, now, z = engaged(PLANE), 10.0, 0.0
    for way in ways:
        z += way
        state, output = step(state, at((0.0, 0.0, z)), now, SETTINGS)
        expected = STIFFNESS * max(0.0, -z)
        assert output.local.normal_force == pytest.approx(expected, abs=1e-9)
        now += PERIOD


# Energy


@given(
    st.lists(st.tuples(*[st.floats(-2e-4, 2e-4)] * 3), min_size=2, max_size=40),
    st.sampled_from([0.0, 50.0]),
    vectors(5.0),
)
@examples(max_examples=60, deadline=None)
def test_a_closed_way_over_a_resting_spring_makes_nothing(
    ways: list[Vec3], friction: float, own_force: Vec3
) -> None:
    """To rounding, whatever force of the hand the body carries; along the surface, too, as long as
    it sticks (mu of 50).
    """
    settings = replace(WIDE[1], friction=friction)
    # Where pressing moves the contact along, friction and normal force find each other in steps.
    C = Compliance3(0.003, 0.005, 1.0 / STIFFNESS, 1e-3, 0.0, 0.0)
    patch = replace(PLANE, compliance=C if friction > 0.0 else None, own_force=own_force)
    # Deep enough to stay in contact.
    tip, now = (0.0, 0.0, -0.02), 10.0
    state = engaged(patch, settings)
    # What was there at the start was not the spring's doing.
    for _ in range(2):
        state, _ = step(state, at(tip), now, settings)
        now += PERIOD
    state = state._replace(passivity=replace_owed(state.passivity))
    for way in ways + [scale(way, -1.0) for way in reversed(ways)]:
        tip = add(tip, way)
        state, output = step(state, at(tip), now, settings)
        now += PERIOD
        # At every point, not only at the end: what is stored can be got back.
        assert state.passivity.owed <= ROUNDING
        assert output.damping_force == pytest.approx(0.0, abs=1e-6)


def replace_owed(passivity: Passivity) -> Passivity:
    """The same spring, of which nothing is owed."""
    return Passivity(0.0, 0.0, passivity.stored)


@given(st.floats(0.001, 0.02), st.floats(-1e-4, 1e-4), st.floats(0.0, 5.0))
def test_what_a_surface_makes_is_force_more_than_the_body_had_times_way(
    depth: float, lift: float, own: float
) -> None:
    """(f - own_force) dx, as the hand rests and the surface comes: science 3.4."""
    held = replace(WIDE[1], smoothing=0.0)
    patch = replace(PLANE, own_force=(0.0, 0.0, own))
    state, tip, now = engaged(patch, held), at((0.0, 0.0, -depth)), 10.0
    for _ in range(2):
        state, _ = step(state, tip, now, held)
        now += PERIOD
    state = state._replace(passivity=replace_owed(state.passivity))
    # No faster than others may move a hand.
    most = 0.99 * PACE / STIFFNESS
    lift = min(max(lift, -most), most)
    state = receive(state, replace(patch, tick=2, x_free=(0.0, 0.0, lift)), now, held)
    state, output = step(state, tip, now, held)
    mean = output.local.normal_force - 0.5 * STIFFNESS * lift
    assert state.passivity.owed == pytest.approx(max(0.0, (mean - own) * lift), abs=1e-12)


# Along the surface


@given(st.floats(-0.004, 0.004), st.floats(-0.004, 0.004), st.floats(0.0, 1.0))
@examples(max_examples=40, deadline=None)
def test_material_that_others_drag_takes_a_sticking_hand_along(
    x: float, y: float, lift: float
) -> None:
    """Science 3.10: P C P f_t = the way of the material, as it was under the hand at first."""
    settings = replace(WIDE[0], friction=2.0)
    C = Compliance3(0.004, 0.004, 1.0 / STIFFNESS, 0.0, 0.0, 0.0)
    patch = replace(PLANE, compliance=C, u_others=(0.001, 0.0, 0.0))
    state, now = engaged(patch, settings), 10.0
    force = ZERO
    for k in range(400):
        if k == 20:
            patch = replace(patch, u_others=(0.001 + x, y, 1e-3 * lift))
        if k % 16 == 4:
            state = receive(state, replace(patch, tick=k), now, settings)
        before = force
        state, output = step(state, at((0.0, 0.0, -0.015)), now, settings)
        force, now = output.on_body, now + PERIOD
        if k == 19:
            assert force == pytest.approx((0.0, 0.0, 0.015 * STIFFNESS), abs=1e-9)
        elif k > 19:
            assert norm(sub(force, before)) <= PACE
    assert force == pytest.approx((STIFFNESS * x, STIFFNESS * y, 0.015 * STIFFNESS), abs=1e-6)


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
