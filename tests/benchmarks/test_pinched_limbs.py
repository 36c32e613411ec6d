"""What is said of two hands on a pinched limb, beside the formula of docs/performance.md."""

from __future__ import annotations

import numpy as np
import pytest

from pinched_limbs import WITHIN, Room, ways_to_rest, worst

BOTH = (30, 30)


@pytest.mark.parametrize(("m", "answer", "kappa"), [(0.87, 1.0, 2.0), (0.87, 0.9, 0.3)])
def test_hands_alike_with_one_delay_need_as_many_ways_as_the_formula_says(
    m: float, answer: float, kappa: float
) -> None:
    share = m / (1.0 + kappa)
    left = (m * answer - share) / (1.0 - share)  # of an error, after a way round
    said = np.log(WITHIN) / np.log(left)
    assert ways_to_rest(Room(m, (answer, answer), BOTH), kappa, 0.0) == pytest.approx(said, abs=1.5)


def test_a_step_for_clamps_is_exact_for_them_and_swings_with_limp_hands() -> None:
    assert ways_to_rest(Room(0.87, (1.0, 1.0), BOTH), 0.0, 0.0) == 0.0
    assert ways_to_rest(Room(0.87, (0.05, 0.05), BOTH), 0.0, 0.0) == np.inf


def test_the_products_step_rests_with_all_hands_and_momentum_swings() -> None:
    for answers in ((1.0, 1.0), (0.5, 0.5), (0.05, 0.05), (1.0, 0.05)):
        assert worst(0.87, answers, 2.0, 0.0) < 20.0
    assert worst(0.87, (1.0, 1.0), 2.0, 0.6) == np.inf
