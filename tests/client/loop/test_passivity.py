from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic_client.loop.passivity import (
    FORGET,
    MAX_DAMPING,
    RAMP,
    SLOW,
    STEP_RATE,
    device_damping_limit,
    dissipate,
    given_energy,
    observe,
)

T = 0.001  # s
forces = st.floats(0.0, 10.0)
speeds = st.floats(-1.0, 1.0)
energies = st.floats(0.0, 0.1)
amounts = st.floats(-0.1, 0.1)
dampings = st.floats(0.0, MAX_DAMPING)


# The ledger


@given(st.lists(st.tuples(amounts, amounts), min_size=1, max_size=50))
def test_what_the_body_gave_and_the_spring_gave_back_is_not_made(
    path: list[tuple[float, float]],
) -> None:
    """Work on the hand = energy that the spring loses + work of the body: a passive port."""
    owed = 0.0
    for less, given_by_body in path:
        owed = observe(owed, less + given_by_body, -less, given_by_body, T)
    assert owed == pytest.approx(0.0, abs=1e-12)


@given(energies, amounts, amounts, amounts)
def test_what_is_more_than_that_is_owed(
    owed: float, work: float, stored: float, from_body: float
) -> None:
    """Nothing is saved up for later: energy that the network took is no credit for making some."""
    made = work + stored - from_body
    after = observe(owed, work, stored, from_body, T)
    assert after == pytest.approx(max(0.0, owed * (1.0 - T / FORGET) + made), abs=1e-15)


def test_what_a_resting_hand_was_given_is_forgotten() -> None:
    owed = 0.01
    for _ in range(round(FORGET / T)):
        owed = observe(owed, 0.0, 0.0, 0.0, T)
    assert owed == pytest.approx(0.01 / math.e, rel=0.01)


@given(st.floats(10.0, 2000.0), st.floats(0.0, 0.02), st.floats(0.01, 1.0), st.floats(0.0, 2.0))
def test_a_spring_stores_the_area_under_what_it_gives(
    stiffness: float, depth: float, scale: float, cut: float
) -> None:
    """Faded to a share, and cut at a limit: work along the way in, and along the way out."""
    limit = cut * scale * stiffness * depth
    # A triangle up to the limit, then a rectangle.
    corner = min(1.0, cut) * depth
    area = 0.5 * scale * stiffness * corner * corner + limit * (depth - corner)
    law = stiffness * depth
    ratio = min(scale * law, limit) / law if law > 0.0 else scale
    stored = given_energy(0.5 * law * depth, ratio, scale)
    assert stored == pytest.approx(area, rel=1e-9, abs=1e-15)


@given(energies, st.floats(0.0, 1e4), st.floats(0.0, 1.0))
def test_a_spring_never_stores_more_than_its_share_nor_less_than_nothing(
    stored: float, ratio: float, scale: float
) -> None:
    """Also while its force still has to come down from a larger one."""
    given_to_hand = given_energy(stored, ratio, scale)
    assert 0.0 <= given_to_hand <= scale * stored * (1.0 + 1e-12)
    if ratio >= scale:
        assert given_to_hand == pytest.approx(scale * stored)


# Damping


@given(speeds, forces, st.floats(0.0, 10.0))
def test_silent_while_nothing_is_owed(speed: float, force: float, limit: float) -> None:
    assert dissipate(0.0, 0.0, force, speed, T, limit) == (0.0, force)


@given(energies, dampings, forces, speeds)
def test_it_only_takes_and_never_pulls(
    owed: float, damping: float, force: float, speed: float
) -> None:
    b, damped = dissipate(owed, damping, force, speed, T, MAX_DAMPING)
    assert 0.0 <= b <= MAX_DAMPING
    assert damped >= 0.0
    # Against the motion, whichever way it goes; never more than the damping in use.
    assert 0.0 <= (damped - force) * speed <= b * speed * speed * (1.0 + 1e-9) + 1e-15


@given(energies, dampings, st.floats(1e-6, 10.0), speeds)
def test_it_is_no_more_than_the_contacts_own_force_and_vanishes_with_it(
    owed: float, damping: float, force: float, speed: float
) -> None:
    """Science 3.9: who breaks contact inward at 0.3 m/s meets no wall of 2.4 N in one period."""
    b, damped = dissipate(owed, damping, force, speed, T, MAX_DAMPING)
    assert abs(damped - force) <= force * (1.0 + 1e-12)
    if b * abs(speed) <= force:
        assert damped == pytest.approx(force + b * speed)
    assert dissipate(owed, damping, 0.0, speed, T, MAX_DAMPING) == (0.0, 0.0)


@given(energies, dampings, st.floats(0.1, 10.0), speeds)
def test_damping_comes_and_goes_without_a_step(
    owed: float, damping: float, force: float, speed: float
) -> None:
    """Within `RAMP`, and of a fast hand more slowly: the force counts."""
    b, _ = dissipate(owed, damping, force, speed, T, MAX_DAMPING)
    assert abs(b - damping) <= MAX_DAMPING * T / RAMP * (1.0 + 1e-12)
    assert abs(b - damping) * abs(speed) <= STEP_RATE * T * (1.0 + 1e-12)


@given(energies, st.floats(SLOW, 0.5))
def test_a_moving_hand_pays_what_is_owed(owed: float, speed: float) -> None:
    """Within the time that the largest damping needs for it, and that of its coming and going."""
    needed = owed / (MAX_DAMPING * speed * speed)
    ramp = max(RAMP, MAX_DAMPING * speed / STEP_RATE)
    left, damping = owed, 0.0
    for _ in range(math.ceil((needed + 2.0 * ramp) / T)):
        damping, damped = dissipate(left, damping, 100.0, speed, T, MAX_DAMPING)
        left = observe(left, -(damped - 100.0) * speed * T, 0.0, 0.0, T)
    assert left <= 0.02 * owed + 1e-6


def test_a_period_that_took_no_time_damps_no_more_than_the_one_before() -> None:
    b, _ = dissipate(0.01, 4.0, 5.0, 0.1, 0.0, MAX_DAMPING)
    assert b == 4.0


@given(st.floats(0.0, 50.0), st.floats(0.0, 1e4))
def test_colgates_bound(damping: float, stiffness: float) -> None:
    """b > K T / 2 + |B|."""
    limit = device_damping_limit(damping, stiffness, T)
    assert 0.0 <= limit <= MAX_DAMPING
    assert limit == 0.0 or limit + 0.5 * stiffness * T <= damping + 1e-9
