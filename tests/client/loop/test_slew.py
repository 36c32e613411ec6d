"""Only the hand moves its force fast: alone, then in the loop, on whatever patches are legal."""

from __future__ import annotations

import math

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from cohaptic.control.friction import FrictionState
from cohaptic.vec import Vec3, add, dot, norm, scale, sub
from cohaptic_client.loop.safety import EXTERNAL_RATE
from cohaptic_client.loop.slew import (
    GAIN_RATE,
    hold_back,
    slew_compliance,
    slew_gain,
    slew_normal,
    turn_back,
)
from tests.client.loop.slew_cases import BALL, PERIOD, ROUNDING, SKEWED, depths, gains
from tests.strategies import normals, vectors


@given(gains, gains, st.floats(0.0, 0.01), st.floats(0.0, 100.0))
def test_a_gain_moves_by_one_percent_per_millisecond_at_most(
    k_h: float, target: float, dt: float, force: float
) -> None:
    """And the force that it makes by no more than others may move it."""
    moved = slew_gain(k_h, target, dt, force)
    # Below 1 N/m, where nothing is felt, it starts at once: from none no share leads up.
    change = abs(math.log(max(1.0, moved) / max(1.0, k_h)))
    assert change <= GAIN_RATE * dt + ROUNDING
    assert change * force <= EXTERNAL_RATE * dt + ROUNDING * force
    assert min(k_h, target) * (1 - ROUNDING) <= moved <= max(k_h, target) * (1 + ROUNDING)


@given(gains, gains)
def test_a_gain_reaches_its_target(k_h: float, target: float) -> None:
    periods = math.ceil(abs(math.log(target / k_h)) / (GAIN_RATE * PERIOD)) + 1
    for _ in range(periods):
        k_h = slew_gain(k_h, target, PERIOD)
    assert k_h == target


@given(depths, depths, st.floats(0.0, 0.01))
def test_what_others_do_moves_what_is_pressed_on_by_so_much_at_most(
    depth: float, target: float, limit: float
) -> None:
    """In contact; out of it there is no force to move, and the surface is where it is shown."""
    held = hold_back(depth, target, limit)
    pressed, was = max(0.0, held), max(0.0, depth)
    assert abs(pressed - was) <= limit + 1e-15
    # Towards the surface that is shown, and all the way if it may.
    assert min(was, max(0.0, target)) <= pressed <= max(was, max(0.0, target))
    if abs(max(0.0, target) - was) <= limit:
        assert pressed == pytest.approx(max(0.0, target), abs=1e-15)
    if max(depth, target) <= 0.0:
        assert held == target


@given(normals, normals, st.floats(0.0, math.pi))
@example((0.0, 0.0, 1.0), (0.0, 0.0, -1.0), 0.01)
@example((0.70710677, 0.0, 0.70710677), (-0.70710677, 0.0, -0.70710677), 1.0)
def test_a_direction_turns_by_so_much_towards_where_it_is_to_be(
    normal: Vec3, target: Vec3, limit: float
) -> None:
    """To the opposite one, too, though no way there is shorter than another."""
    turned, by = turn_back(normal, target, limit)
    angle = between(normal, target)
    assert norm(turned) == pytest.approx(1.0)
    assert by == pytest.approx(min(angle, limit), abs=1e-6)
    assert between(normal, turned) == pytest.approx(by, abs=1e-6)
    assert between(turned, target) == pytest.approx(angle - by, abs=1e-6)


def between(a: Vec3, b: Vec3) -> float:
    """Angle between two unit vectors [rad]."""
    return 2.0 * math.atan2(norm(sub(a, b)), norm(add(a, b)))


@given(normals, normals, vectors(0.001), st.floats(0.0, 2000.0), st.floats(0.01, 10.0))
def test_a_turn_leaves_half_of_the_budget_to_the_size(
    normal: Vec3, target: Vec3, moved: Vec3, k_h: float, force: float
) -> None:
    pace = EXTERNAL_RATE * PERIOD
    turned, taken = slew_normal(normal, target, moved, k_h, force, pace)
    assert 0.0 <= taken <= 0.5 * pace + 1e-12
    aside = norm(sub(moved, scale(normal, dot(normal, moved))))
    assert norm(sub(turned, normal)) * force <= taken + k_h * aside + 1e-9


def test_a_compliance_is_there_at_once_until_something_sticks() -> None:
    rest = FrictionState()
    assert slew_compliance(None, BALL, rest, 0.0, 0.1, 0.01) == BALL
    assert slew_compliance(BALL, SKEWED, rest, 5.0, 0.1, 0.01) == SKEWED
    assert slew_compliance(None, None, rest, 5.0, 0.1, 0.01) is None


def test_a_compliance_moves_no_faster_than_the_force_may() -> None:
    sticks = FrictionState(force=(2.0, 0.0, 0.0), touching=True)
    slow = slew_compliance(BALL, SKEWED, sticks, 5.0, 1.0, 0.005)
    assert slow is not None
    assert BALL.xz < slow.xz < 0.05 * SKEWED.xz
    free = slew_compliance(BALL, SKEWED, sticks, 5.0, 0.5, math.inf)
    assert free is not None
    assert free.xz == pytest.approx(0.5 * SKEWED.xz)
