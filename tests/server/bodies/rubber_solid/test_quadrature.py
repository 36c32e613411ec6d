from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from cohaptic_server.bodies.rubber_solid.quadrature import (
    lattice,
    shape_gradients,
    weights,
)
from cohaptic_server.mesh.tetrahedra import EDGES
from cohaptic_server.numeric import Floats

POWERS = [p for p in itertools.product(range(4), repeat=4) if sum(p) == 3]


@pytest.mark.parametrize("powers", POWERS)
def test_the_rule_is_exact_for_cubics(powers: tuple[int, ...]) -> None:
    """Mean of L^p over a tetrahedron: 3! p! / 6!, as |p| = 3."""
    exact = 6.0 * math.prod(map(math.factorial, powers)) / math.factorial(6)
    values = np.prod(lattice() ** np.array(powers), axis=1)
    assert weights(21) @ values == pytest.approx(exact, rel=1e-12)
    assert (weights(21) > 0.0).all()


def test_shape_gradients_are_those_of_the_quadratic_functions() -> None:
    def functions(L: Floats) -> Floats:
        middles = [4.0 * L[p] * L[q] for p, q in EDGES]
        return np.concatenate([L * (2.0 * L - 1.0), middles])

    D, h = shape_gradients(10), 1e-6
    for L, found in zip(lattice(), D, strict=True):
        for i in range(4):
            step = h * np.eye(4)[i]
            slope = (functions(L + step) - functions(L - step)) / (2.0 * h)
            assert found[:, i] == pytest.approx(slope, abs=1e-8)
