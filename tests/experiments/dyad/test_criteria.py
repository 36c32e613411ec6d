"""The criteria of the experiment `dyad`, against each other and at their limits."""

from __future__ import annotations

import pytest

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


def test_the_stiffest_stable_spring_between_two_hands_is_that_of_du_et_al() -> None:
    free = Hand(0.3, 3.0, 0.0, 1.0)
    assert stiffest_spring((free, free)) == pytest.approx(3.0**2 / (2.0 * 0.3), rel=1e-3)
