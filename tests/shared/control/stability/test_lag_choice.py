from __future__ import annotations

from itertools import accumulate

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic.control.stability.lag_choice import (
    FRACTION,
    choose_lag,
    coupling_matrix,
    coupling_radius,
    hand_time,
    lag_needed,
    margin,
)
from cohaptic.control.stability.room_roots import growth
from tests.examples_of_laws import examples
from tests.shared.control.stability.rooms import draw

seeds = st.integers(0, 2**32 - 1)
couplings = st.floats(0.0, 60.0)
times = st.floats(1e-3, 10.0)  # s
budgets = st.floats(-1.0, 20.0)  # N s/m


def test_no_room_is_unstable_beyond_the_theorems_edge() -> None:
    """Science 3.8, rooms of every kind: unequal delays, soft devices, friction."""
    rng = np.random.default_rng(0)
    strong = unequal = with_friction = nearly = 0
    for _ in range(1500):
        room = draw(rng)
        S, longest = room.coupling, float(room.delays.max())
        m = coupling_radius(S)
        lag = 1.001 * lag_needed(m, longest)
        rate = growth(S, room.delays, lag)
        assert rate < 0.0, (S.tolist(), room.delays.tolist(), lag, rate)
        strong += m > 1.0
        unequal += m > 1.0 and float(room.delays.min()) < 0.3 * longest
        with_friction += m > 1.0 and len(room.stiffness) < len(S)
        nearly += m > 1.0 and rate * longest > -0.003
    # They try the theorem: with a lag, far apart, in three axes, and next to the axis.
    assert strong > 900
    assert unequal > 300
    assert with_friction > 90
    assert nearly > 90


def test_for_equal_delays_the_edge_is_exact() -> None:
    rng = np.random.default_rng(1)
    tried = 0
    while tried < 300:
        room = draw(rng, equal_delays=True)
        m = coupling_radius(room.coupling)
        if m <= 1.0:
            continue
        tried += 1
        edge = lag_needed(m, float(room.delays.max()))
        assert growth(room.coupling, room.delays, 1.001 * edge) < 0.0
        assert growth(room.coupling, room.delays, 0.99 * edge) > 0.0


@given(seeds)
@settings(max_examples=examples(300))
def test_a_coupling_above_one_is_a_positive_eigenvalue(seed: int) -> None:
    """I + S is positive definite for K_i <= 1 / C_ii, so nothing grows at frequency 0."""
    eigenvalues = np.linalg.eigvalsh(draw(np.random.default_rng(seed)).coupling)
    assert float(eigenvalues.min()) > -1.0
    if (m := float(np.abs(eigenvalues).max())) > 1.0:
        assert m == float(eigenvalues.max())


def test_a_gain_above_the_objects_own_stiffness_is_outside_the_theorem() -> None:
    """Two users with K = 1.3 / C_ii: no lag stabilises growth without oscillation."""
    C = np.array([[1.0, 0.9], [0.9, 1.0]])
    S = coupling_matrix(C, [np.array([[1.3]])] * 2)
    assert float(np.linalg.eigvalsh(S).min()) < -1.0
    m, delays = coupling_radius(S), np.array([0.1, 0.1])
    for times in (1.0, 10.0, 100.0):
        assert growth(S, delays, times * lag_needed(m, 0.1)) > 0.0


@given(seeds)
def test_s_is_symmetric_and_its_blocks_are_empty(seed: int) -> None:
    room = draw(np.random.default_rng(seed))
    S = room.coupling
    assert (S == S.T).all()
    start = 0
    for K in room.stiffness:
        end = start + len(K)
        assert not S[start:end, start:end].any()
        start = end
    assert start == len(S)


@given(seeds)
def test_single_axes_are_the_formula(seed: int) -> None:
    room = draw(np.random.default_rng(seed))
    k = np.array([float(K[0, 0]) for K in room.stiffness])
    C = room.C[: len(k), : len(k)]
    S = coupling_matrix(C, [np.array([[x]]) for x in k])
    expected = np.sqrt(np.outer(k, k)) * (C - np.diag(np.diag(C)))
    assert S == pytest.approx(expected, rel=1e-12, abs=1e-12)


@given(seeds)
def test_the_coupling_is_the_same_in_any_order_of_users_and_along_any_axes(seed: int) -> None:
    rng = np.random.default_rng(seed)
    room = draw(rng)
    ends = list(accumulate(len(K) for K in room.stiffness))
    order: list[int] = rng.permutation(len(ends)).tolist()
    rows = [row for i in order for row in range(ends[i] - len(room.stiffness[i]), ends[i])]
    C, K = room.C[np.ix_(rows, rows)], [room.stiffness[i] for i in order]
    m = coupling_radius(room.coupling)
    assert coupling_radius(coupling_matrix(C, K)) == pytest.approx(m, rel=1e-9, abs=1e-12)
    turn = np.eye(len(rows))
    start = 0
    for i, block in enumerate(K):
        Q = np.linalg.qr(rng.normal(size=block.shape))[0]
        turn[start : start + len(Q), start : start + len(Q)] = Q
        K[i] = Q @ block @ Q.T
        start += len(Q)
    turned = coupling_radius(coupling_matrix(turn @ C @ turn.T, K))
    assert turned == pytest.approx(m, rel=1e-6, abs=1e-9)


@given(couplings, times, budgets)
def test_the_chosen_lag_is_never_less_than_the_edge(m: float, T: float, budget: float) -> None:
    room = choose_lag(m, T, budget)
    assert room.lag >= lag_needed(m, T) / FRACTION
    assert room.lag >= hand_time(budget, m) * m
    assert room.coupling == m
    assert room.margin == margin(m, T, room.lag) > (1.0 if m < 1.0 else 0.999)
    if lag_needed(m, T) > 0.0:
        assert room.margin >= (1.0 - 1e-12) / FRACTION
