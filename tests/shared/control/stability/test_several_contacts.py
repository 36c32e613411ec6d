from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic.control.law import Law
from cohaptic.control.laws.model import Gains
from cohaptic.control.stability.lag_choice import coupling_matrix, lag_needed
from cohaptic.control.stability.room_roots import growth
from cohaptic.control.stability.several_contacts import (
    couple,
    largest_uniform_gains,
    loop_matrix,
    room_radius,
)
from cohaptic.errors import SettingError
from tests.examples_of_laws import examples
from tests.system.spectral import random_compliance

sizes, seeds = st.integers(1, 8), st.integers(0, 2**32 - 1)
laws = st.sampled_from(Law)


def any_delay(C: np.ndarray, k_h: np.ndarray, law: Law) -> float:
    radius = couple(C, k_h, law).rho_any_delay
    assert radius is not None
    return radius


@given(sizes, seeds, laws, st.floats(0.1, 2.0))
@settings(deadline=None)
def test_gains_that_are_safe_at_any_delay_are_safe_without(
    n: int, seed: int, law: Law, fraction: float
) -> None:
    C = random_compliance(n, seed)
    judged = couple(C, fraction / np.diag(C), law)
    assert judged.rho_any_delay is not None
    assert judged.rho_no_delay <= judged.rho_any_delay + 1e-12


@given(sizes, seeds, laws)
@settings(deadline=None)
def test_safe_gains_of_the_papers_laws_are_safe_at_any_delay(n: int, seed: int, law: Law) -> None:
    C = random_compliance(n, seed)
    assert any_delay(C, largest_uniform_gains(C, law), law) < 1.0
    if law is not Law.PREDICTIVE:
        judged = couple(C, np.zeros(n), law)
        assert any_delay(C, np.array(judged.safe_k_h), law) < 1.0
        assert judged.coupling is None
        assert judged.lag_needed is None


@given(sizes, seeds, st.floats(0.0, 1.0))
@settings(deadline=None)
def test_the_predictive_law_keeps_the_objects_stiffness_and_is_safe_with_its_lag(
    n: int, seed: int, delay: float
) -> None:
    """Science 3.8: no gain is lowered for a neighbour; the lag needed instead is returned."""
    C, period = random_compliance(n, seed), 0.02
    judged = couple(C, np.zeros(n), Law.PREDICTIVE, delay=delay, simulation_period=period)
    assert judged.safe_k_h == pytest.approx(1.0 / np.diag(C))
    assert judged.safe_integral_gain == (0.0,) * n
    assert judged.felt_stiffness == judged.safe_k_h
    assert judged.stiffness_loss == pytest.approx((0.0,) * n, abs=1e-12)
    assert judged.coupling is not None
    assert judged.lag_needed is not None
    # One period until the surface answers, and one for the client's way there.
    longest = delay + 2.0 * period
    assert judged.lag_needed == pytest.approx(lag_needed(judged.coupling, longest))
    assert (judged.lag_needed > 0.0) is (judged.coupling > 1.0)
    S = coupling_matrix(C, [np.array([[k]]) for k in judged.safe_k_h])
    delays = longest * np.random.default_rng(seed).uniform(0.2, 1.0, n)
    assert growth(S, delays, 1.001 * judged.lag_needed) < 0.0


def test_a_sampled_room_swings_without_its_lag_and_rests_with_it() -> None:
    """Three close users, four periods round the loop; the lag by the theorem and a thousandth."""
    C, delays = np.full((3, 3), 0.8) + 0.2 * np.eye(3), np.array([4, 4, 2])
    gains = [Gains(1.0)] * 3
    assert room_radius(C, gains, Law.PREDICTIVE, delays, 0.02) > 1.05
    lag = 1.001 * lag_needed(1.6, 4 * 0.02)
    assert room_radius(C, gains, Law.PREDICTIVE, delays, 0.02, lag) < 0.99


@given(sizes, seeds, laws, st.floats(0.3, 1.7), st.integers(0, 1000))
@settings(max_examples=examples(200), deadline=None)
def test_without_delay_the_radius_tells_whether_forces_settle(
    n: int, seed: int, law: Law, fraction: float, start: int
) -> None:
    C = random_compliance(n, seed)
    k_h = fraction / np.diag(C)
    radius = couple(C, k_h, law).rho_no_delay
    f = np.random.default_rng(start).normal(size=n)
    first = np.abs(f).max()
    for _ in range(2000):
        f = -k_h * (loop_matrix(C, law) @ f)
        if not 1e-200 < np.abs(f).max() < 1e200:
            break
    if radius < 0.98:
        assert np.abs(f).max() < 1e-3 * first
    elif radius > 1.02:
        assert np.abs(f).max() > first


@given(st.integers(2, 6), seeds, laws)
@settings(max_examples=examples(60), deadline=None)
def test_below_one_forces_settle_whatever_the_delays(n: int, seed: int, law: Law) -> None:
    """Each user sees the others' forces of random earlier times, changing from tick to tick."""
    C = random_compliance(n, seed)
    k_h = largest_uniform_gains(C, law)
    radius = any_delay(C, k_h, law)
    M, rng = loop_matrix(C, law), np.random.default_rng(seed)
    oldest = 6
    history = [rng.normal(size=n) for _ in range(oldest)]
    # Chaotic relaxation shrinks the weighted maximum by rho in every `oldest` updates at the least.
    updates = min(6000, int(oldest * np.log(1e-3) / np.log(min(radius, 0.999))) + 60)
    for _ in range(updates):
        seen = np.array(
            [[history[-rng.integers(1, oldest + 1)][j] for j in range(n)] for _ in range(n)]
        )
        history = [*history[1:], -k_h * np.einsum("ij,ij->i", M, seen)]
    assert np.abs(history[-1]).max() < 1.0


@pytest.mark.parametrize(
    ("C", "words"),
    [
        (np.zeros((2, 3)), "square"),
        (np.zeros((0, 0)), "square"),
        (np.array([[1.0, np.nan], [np.nan, 1.0]]), "finite"),
        (np.array([[1.0, 0.5], [0.1, 1.0]]), "symmetric"),
        (np.array([[1.0, 2.0], [2.0, 1.0]]), "positive definite"),
    ],
)
def test_a_matrix_that_no_elastic_body_has_is_refused(C: np.ndarray, words: str) -> None:
    with pytest.raises(SettingError, match=words):
        couple(C, np.ones(len(C)), Law.PREDICTIVE)
