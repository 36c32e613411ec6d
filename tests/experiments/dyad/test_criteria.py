"""The criteria of the experiment `dyad`, against each other and at their limits."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cohaptic.control.stability.lag_choice import lag_needed
from cohaptic.control.stability.room_roots import growth
from cohaptic_experiments.dyad.criteria import (
    Dyad,
    Hand,
    W,
    at_any_delay,
    by_crossings,
    by_roots,
    by_rule,
    by_small_gain,
    first_crossing,
    rightmost,
    stiffest_spring,
)
from cohaptic_experiments.dyad.held_edges import edge_by_roots, edge_by_small_gain, edge_by_theorem

ONE, OTHER = Hand(0.4, 4.0, 200.0, 400.0), Hand(0.2, 3.0, 500.0, 700.0)


@pytest.mark.parametrize(
    ("hands", "lag"), [((ONE, ONE), 0.02), ((ONE, ONE), 0.04), ((ONE, OTHER), 0.005)]
)
def test_at_the_first_crossing_a_root_lies_on_the_axis(
    hands: tuple[Hand, Hand], lag: float
) -> None:
    loop = Dyad(hands, 0.8, (1.0, 1.0)).gain() / (1.0 + 1j * W * lag) ** 2
    T = first_crossing(loop)
    assert 0.0 < T < 0.3
    on_it = rightmost(Dyad(hands, 0.8, (0.3 * T, 0.7 * T)), lag)
    assert on_it == pytest.approx(0.0, abs=1e-3)
    beside = [rightmost(Dyad(hands, 0.8, (0.3 * x * T, 0.7 * x * T)), lag) for x in (0.97, 1.03)]
    assert beside[0] > 0.03 > -0.03 > beside[1]  # here the longer delay is the better one


@pytest.mark.parametrize("hands", [(ONE, ONE), (ONE, OTHER), (OTHER, OTHER)])
@pytest.mark.parametrize("delays", [(0.01, 0.01), (0.05, 0.2), (0.3, 0.1)])
def test_no_criterion_allows_less_than_the_roots(
    hands: tuple[Hand, Hand], delays: tuple[float, float]
) -> None:
    dyad = Dyad(hands, 0.7, delays)
    exact = by_roots(dyad)
    assert exact > 0.0
    for criterion in (by_crossings, by_small_gain, by_rule, at_any_delay):
        assert criterion(dyad) >= 0.99 * exact


def test_hands_that_cannot_move_are_held_hands() -> None:
    """With no end of stiffness H = 1, and the roots are those of `room_roots`."""
    still = Hand(1.0, 1e5, 1e9, 400.0)
    dyad = Dyad((still, still), 0.8, (0.1, 0.25))
    held = growth(np.array([[0.0, 0.8], [0.8, 0.0]]), np.array(dyad.delays), 0.03)
    assert rightmost(dyad, 0.03) == pytest.approx(held, rel=1e-4)
    assert at_any_delay(dyad) < 1e-5


def test_without_enough_coupling_no_lag_is_needed() -> None:
    dyad = Dyad((ONE, ONE), 0.05, (0.1, 0.1))
    assert by_roots(dyad) == by_crossings(dyad) == at_any_delay(dyad) == 0.0
    assert by_rule(dyad) == pytest.approx(0.005)


def test_a_spring_between_two_hands_bears_the_limit_of_du_et_al() -> None:
    free = Hand(0.3, 3.0, 0.0, 1.0)
    assert stiffest_spring((free, free)) == pytest.approx(3.0**2 / (2.0 * 0.3), rel=1e-3)


def test_three_held_hands_are_at_the_theorems_edge_for_like_delays() -> None:
    S = 0.8 * (np.ones((3, 3)) - np.eye(3))
    like, unlike = np.array([0.2, 0.2, 0.2]), np.array([0.2, 0.06, 0.06])
    edge = 0.2 * math.sqrt(1.6**2 - 1.0) / math.acos(-1.0 / 1.6)
    assert edge_by_theorem(S, like) == edge_by_theorem(S, unlike) == pytest.approx(edge)
    assert lag_needed(1.6, 0.2) == pytest.approx(edge)
    assert edge_by_roots(S, like) == pytest.approx(edge, rel=0.005)
    assert edge_by_roots(S, unlike) < 0.5 * edge
    assert edge_by_small_gain(S, unlike) > 1.1 * edge
