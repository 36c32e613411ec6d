"""Two hands on a linear body: what is predicted of their forces is their equilibrium."""

from __future__ import annotations

import numpy as np
from hypothesis import assume, example, given
from hypothesis import strategies as st

from cohaptic.simulated.hand import Hand
from cohaptic_tools.demo.felt import (
    MAX_PRESS,
    PairForces,
    expected,
    fitting_depth,
)

COMPLIANCE = st.floats(1e-4, 1.0)


@given(COMPLIANCE, st.floats(-0.9, 0.4), st.floats(1e-4, 0.02), st.floats(1e-3, 0.02))
@example(1e-4, -0.5, 0.02, 0.02)  # hard, and pressed deep
def test_a_depth_that_fits_lets_hands_feel_each_other_if_one_that_is_allowed_does(
    own: float, coupling: float, plain: float, dent: float
) -> None:
    C = np.array([[own, coupling * own], [coupling * own, own]])
    per_metre, limit = expected(C[0, 0], C[0, 1], C[1, 1]), 0.02
    assume(per_metre.enough > 0.0)
    depth = float(fitting_depth(per_metre, np.array(plain), dent, limit))
    found = PairForces(depth * per_metre.force, depth * per_metre.felt)
    assert found.force.max() <= MAX_PRESS
    assert depth <= limit
    dented = depth - found.force[0] / Hand().stiffness
    assert depth <= plain or dented <= dent * (1.0 + 1e-9)
    tip = 1.0 - float(per_metre.force[0]) / Hand().stiffness
    deepest = min(limit, dent / tip)
    if PairForces(deepest * per_metre.force, deepest * per_metre.felt).is_felt:
        assert found.is_felt
