from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic_server.mesh.enclosed_volume import volume, volume_gradient, volume_hessian
from cohaptic_server.mesh.icosphere import icosphere
from cohaptic_server.numeric import Floats
from tests.examples_of_laws import examples

X, FACES = icosphere(1, 0.1)


def shaken(seed: int) -> Floats:
    rng = np.random.default_rng(seed)
    return np.asarray(X + 0.005 * rng.normal(size=X.shape))


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=examples(30), deadline=None)
def test_derivatives_match_differences(seed: int) -> None:
    x, direction = shaken(seed), np.random.default_rng(seed + 1).normal(size=(len(shaken(0)), 3))
    h = 1e-5
    slope = (volume(x + h * direction, FACES) - volume(x - h * direction, FACES)) / (2 * h)
    # The third derivative of a volume is constant: V is a cubic of its vertices.
    cubic = h**2 * volume(direction, FACES)
    exact = volume_gradient(x, FACES) @ direction.ravel()
    assert slope - cubic == pytest.approx(exact, rel=1e-7, abs=1e-12)
    change = (
        volume_gradient(x + h * direction, FACES) - volume_gradient(x - h * direction, FACES)
    ) / (2 * h)
    # The gradient is quadratic in x, so the central difference is exact up to rounding.
    assert volume_hessian(x, FACES) @ direction.ravel() == pytest.approx(change, abs=1e-9)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=examples(30), deadline=None)
def test_a_translation_changes_neither_volume_nor_pressure_force(seed: int) -> None:
    x = shaken(seed)
    H = volume_hessian(x, FACES)
    shift = np.tile(np.array([0.3, -0.2, 0.1]), len(x))
    assert np.abs(H @ shift).max() < 1e-15
    assert abs(H - H.T).max() < 1e-15
    assert volume_gradient(x, FACES) @ shift == pytest.approx(0.0, abs=1e-15)
