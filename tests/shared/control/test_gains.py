from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from cohaptic.control.gains import ALPHA, choose_gains
from cohaptic.control.law import Law
from cohaptic.control.laws.model import Gains
from cohaptic.control.laws.pi import all_inside, characteristic, largest_integral
from cohaptic.control.stability.several_contacts import room_radius
from cohaptic.control.stability.single_contact import elastic_object, integral_model, lifted_radius
from tests.examples_of_laws import examples
from tests.system.spectral import random_compliance

PERIOD = 1.0 / 60.0  # s
sizes = st.integers(1, 8)
seeds = st.integers(0, 2**32 - 1)


def gains(law: Law, C: np.ndarray) -> np.ndarray:
    return np.array([g.k_h for g in chosen(law, C, np.ones(len(C), dtype=np.int64))])


def chosen(law: Law, C: np.ndarray, delays: np.ndarray, limit: float = 1e9) -> list[Gains]:
    """Gains of a room whose loops take so many simulation periods each."""
    return [
        choose_gains(
            law,
            row.tolist(),
            i,
            max_stiffness=limit,
            loop_delay=int(delays[i]) * PERIOD,
            simulation_period=PERIOD,
        )
        for i, row in enumerate(C)
    ]


def radius(M: np.ndarray) -> float:
    return float(np.abs(np.linalg.eigvals(M)).max())


@given(sizes, seeds)
def test_proportional_gains_are_safe_at_any_delay(n: int, seed: int) -> None:
    """rho(|C| diag(K)) < 1, science 3.2."""
    C = random_compliance(n, seed)
    assert radius(np.abs(C) * gains(Law.PROPORTIONAL, C)) < 1.0


@given(sizes, seeds, st.floats(1.0, 1e4), st.lists(st.integers(1, 60), min_size=8, max_size=8))
def test_predictive_gains_are_the_objects_own_stiffness_or_the_devices(
    n: int, seed: int, limit: float, delays: list[int]
) -> None:
    """Always, for everybody, whoever else is there and however far away (science 3.8)."""
    C = random_compliance(n, seed)
    for i, g in enumerate(chosen(Law.PREDICTIVE, C, np.array(delays[:n]), limit)):
        assert g == Gains(min(1.0 / C[i, i], limit), 0.0)


@given(seeds)
def test_alone_predictive_is_exact_and_proportional_keeps_its_margin(seed: int) -> None:
    C = random_compliance(1, seed)
    k_o = 1.0 / C[0, 0]
    assert gains(Law.PREDICTIVE, C)[0] == pytest.approx(k_o)
    assert gains(Law.PROPORTIONAL, C)[0] == pytest.approx(ALPHA * k_o)  # eq. (8)


@given(sizes, seeds, st.floats(1.0, 1e4))
def test_no_gain_exceeds_the_stiffness_that_the_device_renders(
    n: int, seed: int, limit: float
) -> None:
    C = random_compliance(n, seed)
    for law in Law:
        for g in chosen(law, C, np.ones(n, dtype=np.int64), limit):
            assert 0.0 < g.k_h <= limit


@given(sizes, seeds, st.lists(st.integers(1, 10), min_size=8, max_size=8))
@settings(max_examples=examples(1500), deadline=None)
def test_rooms_with_an_integral_are_stable_at_the_delays_it_was_chosen_for(
    n: int, seed: int, delays: list[int]
) -> None:
    """Each client's delay its own: the whole room's spectral radius."""
    C, each = random_compliance(n, seed), np.array(delays[:n])
    assert room_radius(C, chosen(Law.PI, C, each), Law.PI, each, PERIOD) < 1.0


@given(sizes, seeds, st.lists(st.integers(1, 10), min_size=8, max_size=8), st.data())
@settings(max_examples=examples(300), deadline=None)
def test_rooms_are_stable_while_the_limit_of_a_change_is_at_work_in_some_integrals(
    n: int, seed: int, delays: list[int], data: st.DataObject
) -> None:
    """Science 3.9: where changes of the force are limited, K_h and I count as a share of theirs."""
    C, each = random_compliance(n, seed), np.array(delays[:n])
    fractions = data.draw(st.lists(st.floats(0.02, 1.0), min_size=n, max_size=n))
    limited = [
        Gains(fraction * g.k_h, fraction * g.integral_gain)
        for fraction, g in zip(fractions, chosen(Law.PI, C, each), strict=True)
    ]
    assert room_radius(C, limited, Law.PI, each, PERIOD) < 1.0


@given(st.floats(0.0, 0.9), st.integers(1, 30))
@settings(deadline=None)
def test_the_integrals_area_shrinks_with_the_delay(kappa: float, periods: int) -> None:
    """Science 3.1; without further delay the edge is eq. (15)'s."""
    edge, later = largest_integral(kappa, periods), largest_integral(kappa, periods + 1)
    assert 0.0 < later < edge
    if periods == 1:
        percent = np.ceil(100.0 * kappa - 1e-9) / 100.0
        assert edge == pytest.approx(1.0 + percent, rel=2e-3)


def test_fixed_gains_are_as_requested_but_never_beyond_the_device() -> None:
    asked = Gains(500.0, 3000.0)
    for limit, k_h in ((1000.0, 500.0), (200.0, 200.0)):
        got = choose_gains(
            Law.PI,
            [0.01],
            0,
            max_stiffness=limit,
            loop_delay=0.1,
            simulation_period=PERIOD,
            fixed=asked,
        )
        assert got == Gains(k_h, 3000.0)


@given(st.floats(0.0, 1.0), st.floats(1e-3, 2.0), st.integers(1, 64))
@settings(deadline=None)
def test_the_polynomial_is_stable_where_the_lifted_loop_is(
    kappa: float, integral: float, periods: int
) -> None:
    """Schur and Cohn's recursion against the eigenvalues of the paper's eq. (4)."""
    loop = integral_model(kappa, integral, 1.0)
    largest = lifted_radius(loop, elastic_object(1.0), 1, periods - 1)
    assume(abs(largest - 1.0) > 1e-6)
    assert all_inside(characteristic(kappa, integral, periods)) == (largest < 1.0)
