from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import settings as tried
from hypothesis import strategies as st

from cohaptic.control.friction import Compliance3
from cohaptic.control.law import Law
from cohaptic.protocol.patch import Patch
from cohaptic.vec import ZERO, Vec3, norm, scale, sub
from cohaptic_client.loop.arrival import (
    receive,
)
from cohaptic_client.loop.period import Period
from cohaptic_client.loop.safety import EXTERNAL_RATE
from cohaptic_client.loop.state import LoopSettings
from cohaptic_client.loop.step import step
from tests.client.loop.loop_cases import (
    PACE,
    PERIOD,
    ROUGH,
    ROUNDING,
    SETTINGS,
    WIDE,
    at,
    engaged,
    near_patches,
    probes,
)
from tests.client.plane import PLANE, STIFFNESS
from tests.examples_of_laws import examples

depths = st.floats(-0.05, 0.05)


@given(
    st.lists(st.tuples(near_patches, st.integers(0, 20)), min_size=1, max_size=6),
    st.floats(-0.01, 0.02),
    st.sampled_from([0.0, 1.0]),
    st.sampled_from([0.0, 8.0]),
)
@tried(max_examples=examples(100), deadline=None)
def test_a_hand_at_rest_is_moved_no_faster_than_others_may_move_it(
    arrivals: list[tuple[Patch, int]], depth: float, smoothing: float, damping: float
) -> None:
    """Whatever surfaces, stiffnesses and forces of its own the server says, held or in a line."""
    settings = replace(SETTINGS, smoothing=smoothing, max_damping=damping)
    state, now = engaged(PLANE, settings), 10.0
    before: Period | None = None
    for tick, (patch, periods) in enumerate(arrivals, start=2):
        patch = replace(patch, tick=tick, law=Law.PREDICTIVE, c_ii=1.0 / patch.k_h)
        state = receive(state, patch, now, settings)
        for _ in range(periods):
            state, output = step(state, at((0.0, 0.0, -depth)), now, settings)
            if before is not None:
                change = abs(output.local.normal_force - before.local.normal_force)
                assert change <= PACE * (1.0 + SECOND_ORDER)
            before, now = output, now + PERIOD


SECOND_ORDER = 1e-9  # of the sum of what rules have taken, relative


@given(
    st.lists(st.tuples(near_patches, st.integers(0, 20), st.booleans()), min_size=1, max_size=6),
    st.floats(-0.01, 0.02),
    st.floats(0.0, 1.0),
    st.sampled_from([0.0, 0.5]),
)
@tried(max_examples=examples(100), deadline=None)
def test_fades_of_the_safety_layer_and_friction_are_part_of_that(
    arrivals: list[tuple[Patch, int, bool]], depth: float, fraction: float, friction: float
) -> None:
    """The whole force on the device, while the server falls silent and comes back.

    A friction force that the normal one moves counts twice: a tenth of it all on this contact.
    """
    limit = PACE * (1.0 + (0.1 if friction > 0.0 else SECOND_ORDER))
    settings = replace(WIDE[0], friction=friction)
    patch = replace(PLANE, compliance=ROUGH.compliance if friction > 0.0 else None)
    tip, now = at((0.0, 0.0, -depth)), 10.0
    state = engaged(patch, settings)
    for _ in range(60):  # until friction and normal force agree
        state, _ = step(state, tip, now, settings)
        now += PERIOD
    now -= PERIOD
    force = scale(state.safety.force, fraction)
    state = replace(state, safety=replace(state.safety, scale=fraction, force=force))
    for tick, (other, periods, silent) in enumerate(arrivals, start=2):
        patch = replace(
            patch, tick=tick, x_free=(0.0, 0.0, other.x_free[2]), u_others=other.u_others
        )
        state = receive(state, patch, now, settings)
        if silent:
            state = state.silenced()
        for _ in range(periods):
            before, now = state.safety.force, now + PERIOD
            state, output = step(state, tip, now, settings)
            assert norm(sub(output.force, before)) <= limit


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


@given(st.floats(-0.004, 0.004), st.floats(-0.004, 0.004), st.floats(0.0, 1.0))
@tried(max_examples=examples(40), deadline=None)
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


@pytest.mark.parametrize("way", [-2e-4, 2e-4])
def test_friction_drives_no_force_on_a_contact_that_is_softer_than_the_gain(way: float) -> None:
    """The compliance along the normal in use may be three times that of the gain in use, for a
    while; the force then grew by a third in each period, whatever the depth was."""
    settings = replace(WIDE[0], friction=0.5)
    soft = 3.0 / STIFFNESS
    patch = replace(PLANE, compliance=Compliance3(soft, soft, soft, 0.0, 0.9 * soft, 0.0))
    state, now, x = engaged(patch, settings), 10.0, 0.0
    for _ in range(200):
        x += way
        state, output = step(state, at((x, 0.0, -0.005)), now, settings)
        now += PERIOD
        assert output.local.normal_force <= 10.0 * STIFFNESS * 0.005
    for _ in range(50):  # and out of contact there is none
        state, _ = step(state, at((x, 0.0, 0.002)), now, settings)
        now += PERIOD
    assert state.normal_force == 0.0


@given(near_patches, near_patches, probes, st.sampled_from(WIDE), st.integers(0, 400))
@tried(max_examples=examples(60), deadline=None)
def test_a_change_of_law_moves_the_force_by_two_percent_a_period_at_most(
    first: Patch, second: Patch, probe: Vec3, settings: LoopSettings, later: int
) -> None:
    """Surface and hand at rest: only the law moves, its gain and its integral."""
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


@pytest.mark.parametrize("kappa", [0.5, 0.85])
@pytest.mark.parametrize("lower", [0.002, -0.002])
def test_friction_that_lifts_the_contact_makes_no_surface_faster(
    kappa: float, lower: float
) -> None:
    """Of a force that a surface takes away friction takes kappa again, period after period."""
    settings = replace(WIDE[0], friction=0.5)
    c = 1.0 / STIFFNESS
    C = Compliance3(4.0 * c, 4.0 * c, c, 0.0, 2.0 * kappa * c, 0.0)
    patch = replace(PLANE, compliance=C)
    state, now, x = engaged(patch, settings), 10.0, 0.0
    for _ in range(300):  # it slides, to where friction presses it in
        x += 1e-4
        state, _ = step(state, at((x, 0.0, -0.005)), now, settings)
        now += PERIOD
    moved = replace(patch, tick=2, x_free=(0.0, 0.0, -lower))
    state = receive(state, moved, now, settings)
    before, largest = None, 0.0
    for _ in range(300):  # and stays where it is
        state, output = step(state, at((x, 0.0, -0.005)), now, settings)
        if before is not None:
            largest = max(largest, norm(sub(output.force, before)))
        before, now = output.force, now + PERIOD
    assert 0.1 * PACE < largest <= PACE * (1.0 + SECOND_ORDER)
