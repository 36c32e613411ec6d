"""Two hands on a linear body: what is predicted of their forces is their equilibrium."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

from cohaptic.simulated.hand import Hand
from cohaptic_server.world.equilibrium import complementarity
from cohaptic_tools.demo.felt import (
    FELT,
    LEAST_PRESS,
    MOST_PRESS,
    PairForces,
    expected,
    fitting_depth,
)

COMPLIANCE = st.floats(1e-4, 1.0)


def pair(*values: float) -> PairForces:
    """The forces on both hands, and what each feels."""
    return PairForces(np.array(values[:2]), np.array(values[2:]))


@given(COMPLIANCE, COMPLIANCE, st.floats(-0.99, 0.99))
@example(0.01, 0.001, -0.99)  # the second tip is pushed out beyond the resting surface
def test_the_forces_predicted_are_those_of_hands_that_only_push(
    first: float, second: float, coupling: float
) -> None:
    between = coupling * (first * second) ** 0.5
    C = np.array([[first, between], [between, second]])
    found = expected(np.array(first), np.array(between), np.array(second))
    force = complementarity(C + np.eye(2) / Hand().stiffness, np.array([1.0, 0.5]))
    assert found.force == pytest.approx(force, rel=1e-6, abs=1e-6)
    alone = np.maximum(0.0, C @ force / np.diag(C))
    assert found.felt == pytest.approx(np.abs(force - alone), rel=1e-6, abs=1e-6)


@given(COMPLIANCE, st.floats(-0.9, 0.4), st.floats(1e-4, 0.02), st.floats(1e-3, 0.02))
@example(1e-4, -0.5, 0.02, 0.02)  # hard, and pressed deep
def test_a_depth_that_fits_lets_hands_feel_each_other_if_one_that_is_allowed_does(
    own: float, coupling: float, plain: float, dent: float
) -> None:
    C = np.array([[own, coupling * own], [coupling * own, own]])
    per_metre, most = expected(C[0, 0], C[0, 1], C[1, 1]), 0.02
    assume(per_metre.enough > 0.0)
    depth = float(fitting_depth(per_metre, np.array(plain), dent, most))
    found = PairForces(depth * per_metre.force, depth * per_metre.felt)
    assert found.force.max() <= MOST_PRESS
    assert depth <= most
    dented = depth - found.force[0] / Hand().stiffness
    assert depth <= plain or dented <= dent * (1.0 + 1e-9)
    tip = 1.0 - float(per_metre.force[0]) / Hand().stiffness
    deepest = min(most, dent / tip)
    if PairForces(deepest * per_metre.force, deepest * per_metre.felt).is_felt:
        assert found.is_felt


def test_it_is_felt_where_all_four_forces_are_enough_and_none_is_too_much() -> None:
    assert pair(LEAST_PRESS, MOST_PRESS, FELT, FELT).is_felt
    for change in range(4):
        values = [1.0, 1.0, FELT, FELT]
        values[change] *= 0.4
        assert not pair(*values).is_felt
    assert not pair(1.0, 1.01 * MOST_PRESS, FELT, FELT).is_felt
    assert pair(2.0 * LEAST_PRESS, 9.0, 3.0 * FELT, 9.0).enough == pytest.approx(2.0)
