from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic_client.passivity import (
    FORGET,
    MAX_DAMPING,
    RAMP,
    SLOW,
    device_damping_limit,
    dissipate,
    observe,
)

T = 0.001  # s
forces = st.floats(0.0, 10.0)
speeds = st.floats(-1.0, 1.0)
energies = st.floats(0.0, 0.1)


@given(st.lists(st.tuples(forces, st.floats(-1e-3, 1e-3)), min_size=1, max_size=50))
def test_a_body_that_has_the_hands_force_already_makes_nothing(
    path: list[tuple[float, float]],
) -> None:
    """No delay: f is own_force, whatever moves."""
    owed = 0.0
    for force, moved in path:
        owed = observe(owed, force, force, moved, T)
    assert owed == 0.0


@given(forces, forces)
def test_a_surface_at_rest_makes_nothing(force: float, own: float) -> None:
    assert observe(0.0, force, own, 0.0, T) == 0.0


@given(forces, forces, st.floats(-1e-3, 1e-3))
def test_what_is_made_is_force_more_than_the_body_had_times_way(
    force: float, own: float, moved: float
) -> None:
    made = (force - own) * moved
    assert observe(0.0, force, own, moved, T) == pytest.approx(max(0.0, made))


@given(energies, forces, forces, st.floats(-1e-4, 1e-4))
def test_nothing_is_saved_up_for_later(owed: float, force: float, own: float, moved: float) -> None:
    """Energy that the network took is no credit for making some."""
    assert observe(owed, force, own, moved, T) >= 0.0


def test_what_a_resting_hand_was_given_is_forgotten() -> None:
    owed = 0.01
    for _ in range(round(FORGET / T)):
        owed = observe(owed, 1.0, 1.0, 0.0, T)
    assert owed == pytest.approx(0.01 / math.e, rel=0.01)


@given(speeds, forces, st.floats(0.0, 10.0))
def test_silent_while_nothing_is_owed(speed: float, force: float, limit: float) -> None:
    assert dissipate(0.0, 0.0, force, speed, T, limit) == (0.0, 0.0, force)


@given(energies, st.floats(0.0, 8.0), forces, speeds)
def test_it_only_takes_and_never_pulls(
    owed: float, damping: float, force: float, speed: float
) -> None:
    left, b, damped = dissipate(owed, damping, force, speed, T, MAX_DAMPING)
    assert 0.0 <= left <= owed
    assert 0.0 <= b <= MAX_DAMPING
    assert damped >= 0.0
    # Against the motion, whichever way it goes.
    assert (damped - force) * speed >= 0.0


@given(energies, st.floats(0.0, 8.0), st.floats(0.1, 10.0), speeds)
def test_damping_comes_and_goes_without_a_step(
    owed: float, damping: float, force: float, speed: float
) -> None:
    _, b, _ = dissipate(owed, damping, force, speed, T, MAX_DAMPING)
    assert abs(b - damping) <= MAX_DAMPING * T / RAMP * (1.0 + 1e-12)


@given(energies, st.floats(SLOW, 0.5))
def test_a_moving_hand_pays_what_is_owed(owed: float, speed: float) -> None:
    """Within the time that the largest damping needs for it, and the ramp."""
    needed = owed / (MAX_DAMPING * speed * speed)
    left, damping = owed, 0.0
    for _ in range(math.ceil((needed + 2.0 * RAMP) / T)):
        left, damping, _ = dissipate(left, damping, 100.0, speed, T, MAX_DAMPING)
    assert left <= 0.02 * owed + 1e-6


def test_out_of_contact_it_does_nothing() -> None:
    assert dissipate(0.01, 4.0, 0.0, 0.1, T, MAX_DAMPING) == (0.01, 0.0, 0.0)


@given(st.floats(0.0, 50.0), st.floats(0.0, 1e4))
def test_colgates_bound(damping: float, stiffness: float) -> None:
    """b > K T / 2 + |B|."""
    limit = device_damping_limit(damping, stiffness, T)
    assert 0.0 <= limit <= MAX_DAMPING
    assert limit == 0.0 or limit + 0.5 * stiffness * T <= damping + 1e-9
