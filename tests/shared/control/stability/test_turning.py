"""The theorem of science 3.12 against the exact edge of one loop and against rooms in time."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from cohaptic_server.numeric import Floats
from cohaptic_server.world.lags.turning import turning_needed
from tests.examples_of_laws import examples

STEPS = 400  # of the longest delay, in a simulation


def random_room(seed: int, hands: int, coupling: float, turned: float) -> Floats:
    """S of some hands, each with its normal and a tangent, from a random elastic body."""
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(2 * hands, 2 * hands + 2))
    C = root @ root.T
    own = 1.0 / np.sqrt(np.diag(C))
    C = C * own[:, None] * own
    scale = np.repeat([1.0, turned], hands)
    S = C * scale[:, None] * scale
    owner = np.tile(np.arange(hands), 2)
    S[owner[:, None] == owner] = 0.0
    S[:hands, :hands] *= coupling
    return np.asarray(S)


def grows(S: Floats, hands: int, delays: Floats, turning: float, longest: float) -> bool:
    """Whether the loop, in small steps of time, ends larger than it was in the middle."""
    dt = longest / STEPS
    steps = np.maximum(1, np.round(delays / dt).astype(int))
    span = round(40.0 * (longest + turning) / dt)
    p = np.zeros((span, hands))
    p[: steps.max() + 1] = np.linspace(1.0, -0.5, hands)
    t = np.zeros(hands)
    size = np.zeros(span)
    for k in range(steps.max() + 1, span):
        said = np.array([p[k - steps[i], i] for i in range(hands)])
        z = S @ np.concatenate([said, t])
        t = (t * turning + dt * (z[hands:])) / (turning + dt)
        p[k] = -z[:hands]
        size[k] = np.abs(p[k]).max()
    third = span // 3
    return bool(size[-third:].max() > 1.05 * size[third : 2 * third].max() + 1e-9)


@given(st.integers(0, 10**6), st.integers(2, 3), st.floats(0.1, 0.9), st.floats(0.2, 3.0))
@settings(max_examples=examples(12), deadline=None)
def test_beyond_the_edge_no_room_of_any_delays_grows(
    seed: int, hands: int, coupling: float, turned: float
) -> None:
    S = random_room(seed, hands, coupling, turned)
    needed = turning_needed(S, hands, 0.2)
    assume(needed < 2.0)
    rng = np.random.default_rng(seed)
    for _ in range(2):
        delays = rng.uniform(0.05, 0.2, hands)
        delays[0] = 0.2
        assert not grows(S, hands, delays, 1.05 * needed + 1e-3, 0.2)


def one_turns_the_other(coupling: float) -> Floats:
    """One presses, the other is turned by it: a loop of the gain -c^2 (science 3.12)."""
    S = np.zeros((3, 3))
    S[0, 2] = S[2, 0] = coupling
    return S


@pytest.mark.parametrize("coupling", [1.2, 1.8, 3.0])
def test_the_edge_is_within_a_factor_of_the_exact_one(coupling: float) -> None:
    q = coupling * coupling
    exact = 0.2 * math.sqrt(q * q - 1.0) / math.acos(-1.0 / q)
    assert exact <= turning_needed(one_turns_the_other(coupling), 1, 0.2) <= 2.0 * exact


def test_well_below_the_exact_edge_it_grows_so_that_the_lag_is_needed() -> None:
    S, delays = np.zeros((4, 4)), np.array([0.2, 0.2])
    S[0, 3] = S[3, 0] = 2.0
    exact = 0.2 * math.sqrt(15.0) / math.acos(-0.25)
    assert grows(S, 2, delays, 0.5 * exact, 0.2)
    assert not grows(S, 2, delays, 1.5 * exact, 0.2)


def test_weak_turning_needs_no_lag_and_hands_that_turn_each_other_have_none() -> None:
    assert turning_needed(one_turns_the_other(0.9), 1, 0.2) == 0.0
    each = np.array(
        [[0.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.1], [0.0, 0.0, 1.1, 0.0]]
    )
    assert turning_needed(each, 2, 0.2) == math.inf
    assert turning_needed(np.zeros((2, 2)), 0, 0.2) == 0.0


@given(st.floats(1.05, 4.0), st.floats(0.01, 0.5), st.floats(0.0, 1.0))
def test_it_grows_with_coupling_and_delay_and_with_the_rooms_own_lag(
    coupling: float, delay: float, lag: float
) -> None:
    S = one_turns_the_other(coupling)
    here = turning_needed(S, 1, delay)
    assert turning_needed(S, 1, 2.0 * delay) == pytest.approx(2.0 * here, rel=1e-6)
    assert turning_needed(1.1 * S, 1, delay) > here
    assert turning_needed(S, 1, delay, lag) >= 0.0
