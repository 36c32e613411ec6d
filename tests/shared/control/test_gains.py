from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.control.gains import choose_gain, coupled_stiffness
from cohaptic.control.law import Law
from tests.system.spectral import random_compliance

sizes = st.integers(1, 8)
seeds = st.integers(0, 2**32 - 1)


def gains(law: Law, C: np.ndarray) -> np.ndarray:
    return np.array(
        [choose_gain(law, row.tolist(), i, max_stiffness=1e9) for i, row in enumerate(C)]
    )


def radius(M: np.ndarray) -> float:
    return float(np.abs(np.linalg.eigvals(M)).max())


@given(sizes, seeds)
def test_proportional_gains_are_safe_at_any_delay(n: int, seed: int) -> None:
    """rho(|C| diag(K)) < 1, science 3.2."""
    C = random_compliance(n, seed)
    assert radius(np.abs(C) * gains(Law.PROPORTIONAL, C)) < 1.0


@given(sizes, seeds)
def test_predictive_gains_are_safe_at_any_delay(n: int, seed: int) -> None:
    """rho(|K W|) < 1 with W = C off its diagonal, science 3.3."""
    C = random_compliance(n, seed)
    W = C - np.diag(np.diag(C))
    assert radius(gains(Law.PREDICTIVE, C)[:, None] * np.abs(W)) < 1.0


@given(seeds)
def test_alone_predictive_is_exact_and_proportional_keeps_its_margin(seed: int) -> None:
    C = random_compliance(1, seed)
    k_o = 1.0 / C[0, 0]
    assert gains(Law.PREDICTIVE, C)[0] == pytest.approx(k_o)
    assert 0.9 * k_o < gains(Law.PROPORTIONAL, C)[0] < k_o  # eq. (8)


@given(seeds)
def test_two_users_lose_nothing_unless_they_nearly_touch(seed: int) -> None:
    """Two users on any elastic body qualify: |C_12| < C_11; the margin costs at most 5 %."""
    C = random_compliance(2, seed)
    C[0, 0] = C[1, 1] = np.sqrt(C[0, 0] * C[1, 1])  # two like places of a symmetric body
    assert gains(Law.PREDICTIVE, C)[0] >= 0.95 / C[0, 0] * 0.999


@given(sizes, seeds, st.floats(1.0, 1e4))
def test_no_gain_exceeds_what_the_device_renders(n: int, seed: int, limit: float) -> None:
    C = random_compliance(n, seed)
    for law in Law:
        for i, row in enumerate(C):
            assert 0.0 < choose_gain(law, row.tolist(), i, max_stiffness=limit) <= limit


def test_the_rule_for_a_single_contact_is_not_enough_for_two() -> None:
    """Science 3.2: 0.9 / C_ii on two coupled contacts diverges, the coupled rule does not."""
    C = np.array([[1.0, 0.3], [0.3, 1.0]])
    assert radius(C * (0.9 / np.diag(C))) > 1.0
    assert radius(C * gains(Law.PROPORTIONAL, C)) < 1.0
    assert coupled_stiffness(C[0].tolist()) == pytest.approx(1.0 / 1.3)
