from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic.control.stability.anticipation import (
    LEAST_KAPPA,
    SOFTEST,
    anticipated,
    gains_left,
    hand_factor,
)
from cohaptic_server.numeric import Floats
from tests.examples_of_laws import examples

seeds = st.integers(0, 2**32 - 1)
THETA = 0.12  # s


def coupling(rng: np.random.Generator, n: int) -> Floats:
    """S of hands on a random body: loosely coupled, near each other, or on a nearly rigid part."""
    A = rng.standard_normal((n, n + int(rng.integers(1, 3))))
    C = A @ A.T + float(rng.choice([0.0, 1.0, 10.0])) * n * np.ones((n, n))
    root = np.sqrt(rng.uniform(0.2, 1.0, n) / np.diag(C))
    S = C * root[:, None] * root
    np.fill_diagonal(S, 0.0)
    return np.asarray(S)


# The parts


@given(st.floats(0.0, 60.0), st.floats(0.0, 0.999))
def test_whatever_a_hand_does_an_error_becomes_smaller(positive: float, negative: float) -> None:
    room = gains_left(positive, -negative)
    assert 0.0 <= room.held <= negative
    assert room.limp < max(SOFTEST + 1e-9, room.together + 1e-5) < 1.0
    assert room.kappa >= LEAST_KAPPA
    # As much of the rest is anticipated as a limp hand allows.
    if room.kappa > LEAST_KAPPA and room.together < 0.89:
        assert room.limp == pytest.approx(SOFTEST, abs=1e-6)


@given(seeds, st.integers(2, 8))
def test_what_is_left_of_the_coupling_is_negative_and_below_one(seed: int, n: int) -> None:
    S = coupling(np.random.default_rng(seed), n)
    part = anticipated(S)
    assert pytest.approx(np.eye(n), abs=1e-9) == part.solve @ (np.eye(n) + part.X)
    left = np.linalg.eigvalsh(0.5 * ((S - part.X) @ part.solve + part.solve @ (S - part.X)))
    assert left[-1] <= 1e-9
    assert -left[0] == pytest.approx(part.gains.held, abs=1e-6)
    assert part.radius == pytest.approx(np.abs(np.linalg.eigvalsh(S)).max())
    of_more = anticipated(S, 1e9).X
    assert np.linalg.eigvalsh(of_more)[0] >= -1e-6


# Hands held still


def _errors(S: Floats, ticks: list[int], steps: int, *, anticipating: bool) -> Floats:
    """Largest error of the forces after each step of a sampled room without a lag."""
    n = len(S)
    d = np.ones(n)
    expected = np.linalg.solve(np.eye(n) + S, d)
    part = anticipated(S)
    carried = [np.zeros(n)]
    errors: list[float] = []
    for step in range(steps):
        then = np.array([carried[max(0, step - t)] for t in ticks])  # (n, n), a row for each user
        f = d - np.einsum("ij,ij->i", S, then)
        if anticipating:
            f = part.solve @ (f + np.einsum("ij,ij->i", part.X, then))
        carried.append(f)
        errors.append(float(np.abs(f - expected).max()))
    return np.array(errors)


@given(seeds, st.integers(2, 8), st.data())
@settings(max_examples=examples(50))
def test_held_hands_come_to_rest_without_a_lag_at_any_unequal_delays(
    seed: int, n: int, data: st.DataObject
) -> None:
    """In the norm of phi an error falls by `held` within the longest delay."""
    S = coupling(np.random.default_rng(seed), n)
    ticks = data.draw(st.lists(st.integers(0, 12), min_size=n, max_size=n))
    held = anticipated(S).gains.held
    rounds = 1.0 + np.log(1e-3) / np.log(min(0.99, max(0.01, held)))
    errors = _errors(S, ticks, int((max(ticks) + 1) * (rounds + 2.0)) * 3, anticipating=True)
    assert errors[-1] <= 1e-2 * max(1.0, errors.max())


def test_the_same_room_swings_up_where_nothing_is_anticipated() -> None:
    S = 0.6 * (np.ones((4, 4)) - np.eye(4))  # m = 1.8
    assert _errors(S, [3, 3, 5, 9], 300, anticipating=False)[-1] > 1e4
    assert _errors(S, [3, 3, 5, 9], 300, anticipating=True)[-1] < 1e-6


# Hands that move


def _turns(
    S: Floats, rng: np.random.Generator, fraction: float, stiffness: float = np.inf
) -> float:
    """Roots to the right of the axis, of a room of random hands, by the argument principle.

    Hands of 20 g to 0.5 kg, of the damping M / theta, two of five without any stiffness. Where the
    stiffness is limited, all K have that limit times damping / theta, of the lightest hand.
    """
    n = len(S)
    M, K = rng.uniform(0.02, 0.5, n), rng.uniform(10.0, 2000.0, n)
    if stiffness < np.inf:
        K = np.full(n, stiffness * float(M.min()) / THETA**2)
    k = np.where(rng.random(n) < 0.4, 0.0, rng.uniform(0.0, 300.0, n))
    T = rng.uniform(0.01, 0.6, n)
    part = anticipated(S)
    s = 1j * np.geomspace(1e-4, 3e3, 6000)[:, None]
    hand = M * s * s + M / THETA * s + k
    H = (hand / (hand + K))[:, :, None]
    tau = fraction * hand_factor(part.gains, stiffness) * THETA
    lag = 1.0 / (1.0 + s[:, :, None] * tau)
    around = np.exp(-s * T)[:, :, None] * ((1.0 - H) * part.X - H * (S - part.X))
    phase = np.unwrap(np.angle(np.linalg.det(np.eye(n) - lag * (part.solve @ around))))
    return abs(float(phase[-1] - phase[0])) / np.pi


def test_moving_hands_of_any_stiffness_are_stable_behind_a_lag_that_knows_no_delay() -> None:
    """The theorem on 60 random rooms; a tenth of the lag is too little in most of them."""
    rng = np.random.default_rng(3)
    rooms = [coupling(rng, int(rng.integers(2, 7))) for _ in range(60)]
    assert max(_turns(S, rng, 1.0) for S in rooms) < 0.1
    assert sum(_turns(S, rng, 0.1) > 0.5 for S in rooms) > 20


@pytest.mark.parametrize("stiffness", [0.3, 1.0, 3.0])
def test_hands_on_soft_springs_need_less_of_it_or_none(stiffness: float) -> None:
    """The theorem with a limit of K; with a hundred times that, many swing without a lag."""
    rng = np.random.default_rng(4)
    rooms = [coupling(rng, int(rng.integers(2, 7))) for _ in range(60)]
    lags = [hand_factor(anticipated(S).gains, stiffness) for S in rooms]
    # Without a lag the loop does not end at 0, and part of a turn is left.
    assert max(_turns(S, rng, 1.0, stiffness) for S in rooms) < 0.5
    assert all(a <= hand_factor(anticipated(S).gains) for a, S in zip(lags, rooms, strict=True))
    if stiffness < 1.0:
        assert sum(lag == 0.0 for lag in lags) > 20
    soft = [S for S, lag in zip(rooms, lags, strict=True) if lag < 0.5]
    stiffer = [_turns(S, rng, 0.0, 100.0 * stiffness) for S in soft]
    assert sum(turns > 0.5 for turns in stiffer) > len(soft) / 4


@given(st.floats(0.0, 60.0), st.floats(0.0, 0.99), st.floats(1e-3, 1e3), st.floats(-1e3, 1e3))
def test_the_worst_hand_is_no_worse_than_the_factor_says(
    positive: float, negative: float, p: float, stiff: float
) -> None:
    """The gain of a user's row, over frequency and stiffness, against the lag's."""
    room = gains_left(positive, -negative)
    r = hand_factor(room) * (1.0 + 1e-9)
    q = max(stiff, -p)  # (k - M w^2) / (b w) is never below -theta w
    for kappa in (0.01, 0.3, 1.0, abs(q), float(np.hypot(q, 1.0)), 30.0):
        H = (q + 1j) / (q + kappa + 1j) if kappa else 1.0
        row = np.hypot(abs(1.0 - H) * room.together, abs(-(1.0 - H) * room.apart + H * room.held))
        assert row <= np.hypot(1.0, r * p) * (1.0 + 5e-3)


@given(
    st.floats(0.0, 60.0),
    st.floats(0.0, 0.99),
    st.floats(1e-3, 1e3),
    st.floats(-1e3, 1e3),
    st.floats(0.0, 1.0),
    st.floats(1e-2, 1e2),
)
def test_the_worst_hand_on_a_limited_spring_is_no_worse_than_its_factor_says(
    positive: float, negative: float, p: float, stiff: float, fraction: float, stiffness: float
) -> None:
    room = gains_left(positive, -negative)
    r = hand_factor(room, stiffness) * (1.0 + 1e-9)
    q, kappa = max(stiff, -p), fraction * stiffness / p
    H = (q + 1j) / (q + kappa + 1j)
    row = np.hypot(abs(1.0 - H) * room.together, abs(-(1.0 - H) * room.apart + H * room.held))
    assert row <= np.hypot(1.0, r * p) * (1.0 + 5e-3)
