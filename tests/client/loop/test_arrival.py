from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from cohaptic.control.geometry import Sight
from cohaptic.protocol.patch import Patch
from cohaptic.vec import ZERO, Vec3, norm, sub
from cohaptic_client.loop.arrival import (
    FORGET_GAPS,
    LONGEST_PATIENCE,
    PATIENCE,
    next_patience,
    receive,
)
from cohaptic_client.loop.state import LoopSettings, LoopState, flat_surface
from cohaptic_client.loop.step import step
from tests.client.loop.loop_cases import (
    PERIOD,
    ROUNDING,
    SETTINGS,
    TICK,
    WIDE,
    at,
    engaged,
    near_patches,
    probes,
    shown_at,
)
from tests.client.plane import PLANE
from tests.strategies import counts


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
        # Time since a patch that counted: one that is left out must not keep the server alive.
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
    first: Patch, second: Patch, other: Patch, fraction: float, last: Vec3, probe: Vec3
) -> None:
    """Whatever it says of surface and gain: that period's force is the same for any two of them."""
    second, other = (
        replace(p, law=first.law, integral_gain=first.integral_gain) for p in (second, other)
    )
    for settings in WIDE:
        state, _ = step(engaged(first, settings), at(last), 10.0, settings)
        now = 10.0 + fraction * TICK
        seen = {
            step(receive(state, patch, now, settings), at(probe), now, settings)[1].force
            for patch in (replace(second, tick=2), replace(other, tick=2))
        }
        assert len(seen) == 1


@given(near_patches, near_patches, probes, st.sampled_from(WIDE))
def test_within_a_simulation_period_the_surface_goes_over_to_the_new_patch(
    first: Patch, second: Patch, probe: Vec3, settings: LoopSettings
) -> None:
    state, _ = step(engaged(first, settings), at(probe), 10.0 - PERIOD, settings)
    state = receive(state, replace(second, tick=2), 10.0, settings)
    before, after = (flat_surface(patch).look(probe) for patch in (first, second))
    at_once = shown_at(state, probe, 10.0, settings)
    assert at_once is not None
    assert close(at_once, before)
    assert shown_at(state, probe, 10.0 + 1.001 * TICK, settings) == after
    half = shown_at(state, probe, 10.0 + 0.5 * TICK, settings)
    assert half is not None
    assert half.depth == pytest.approx(0.5 * (before.depth + after.depth), abs=ROUNDING)


@given(near_patches, near_patches, near_patches, probes, st.floats(0.1, 0.9))
def test_a_patch_that_comes_early_starts_from_what_was_shown(
    first: Patch, second: Patch, third: Patch, probe: Vec3, fraction: float
) -> None:
    """Jitter bunches patches: the way to the one before is then not over yet."""
    state, _ = step(engaged(first), at(probe), 10.0, SETTINGS)
    state = receive(state, replace(second, tick=2), 10.0, SETTINGS)
    now = 10.0 + fraction * TICK
    state, _ = step(state, at(probe), now, SETTINGS)
    before = shown_at(state, probe, now, SETTINGS)
    after = shown_at(receive(state, replace(third, tick=3), now, SETTINGS), probe, now, SETTINGS)
    assert before is not None
    assert after is not None
    assert close(before, after)


def close(a: Sight, b: Sight) -> bool:
    gaps = [abs(x - y) for x, y in zip((a.depth, *a.normal), (b.depth, *b.normal), strict=True)]
    # Normals come from 32 bits: their length is one to 1e-7.
    return max(gaps) < 1e-7 and norm(sub(a.own_force, b.own_force)) < ROUNDING


@pytest.mark.parametrize(("age", "silent"), [(0.0, False), (0.0999, False), (0.1001, True)])
def test_a_server_is_silent_when_its_newest_patch_is_too_old(age: float, silent: bool) -> None:
    state = receive(LoopState(), PLANE, 0.0, SETTINGS)
    assert step(state, at(ZERO), age, SETTINGS)[1].silent is silent


gaps = st.lists(st.floats(0.001, 2.0), min_size=1, max_size=8)


@given(gaps, st.floats(0.0, 2.0))
def test_a_silence_as_long_as_the_link_has_had_one_of_late_is_no_end(
    gaps: list[float], wait: float
) -> None:
    """One that is longer still is; on a punctual link the settings decide. An outage
    says nothing of the link's way.
    """
    state, now = receive(LoopState(), PLANE, 10.0, SETTINGS), 10.0
    for tick, gap in enumerate(gaps, start=2):
        # A gap that is an outage only by the rounding of `now` tells nothing.
        assume(abs(gap - LONGEST_PATIENCE) > 1e-9)
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
