from __future__ import annotations

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.control.laws.predictive import predictive_force

stiffness = st.floats(10.0, 5000.0)
depths = st.floats(-0.01, 0.03)


@given(stiffness, st.lists(depths, min_size=2, max_size=60))
def test_a_closed_way_makes_nothing(k_h: float, path: list[float]) -> None:
    """Science 3.8: an integral beyond the device's limit would generate energy at every frequency.

    Work on the hand along the way, exactly: the force is linear between depths that press.
    """
    work = 0.0
    for a, b in itertools.pairwise([*path, path[0]]):
        a, b = max(0.0, a), max(0.0, b)
        work -= 0.5 * (predictive_force(a, k_h) + predictive_force(b, k_h)) * (b - a)
    assert work == pytest.approx(0.0, abs=1e-12 * k_h)
