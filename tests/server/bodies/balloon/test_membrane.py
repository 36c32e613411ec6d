from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic_server.bodies.balloon.membrane import Membrane
from cohaptic_server.mesh.icosphere import icosphere
from cohaptic_server.mesh.rigid_motions import rigid_motions
from cohaptic_server.numeric import Floats
from tests.examples_of_laws import examples

X, FACES = icosphere(1, 0.1)
SHEET = Membrane.at_rest(X / 1.5, FACES, mu_h=250.0)
seeds = st.integers(0, 2**32 - 1)


def shaken(seed: int, size: float = 0.003) -> Floats:
    return np.asarray(X + size * np.random.default_rng(seed).normal(size=X.shape))


def test_a_stretched_sphere_has_the_energy_of_the_formula() -> None:
    """Equal stretch s in both directions: W = mu h / 2 (2 s^2 + s^-4 - 3) per rest area."""
    s = 1.5
    expected = 0.5 * 250.0 * (2 * s**2 + s**-4 - 3) * SHEET.rest_area.sum()
    assert SHEET.energy(X) == pytest.approx(expected, rel=1e-12)


@given(seeds)
@settings(max_examples=examples(20), deadline=None)
def test_the_gradient_is_that_of_the_energy(seed: int) -> None:
    x = shaken(seed)
    direction = np.random.default_rng(seed + 1).normal(size=X.shape)
    h = 1e-6
    slope = (SHEET.energy(x + h * direction) - SHEET.energy(x - h * direction)) / (2 * h)
    assert slope == pytest.approx(SHEET.gradient(x) @ direction.ravel(), rel=1e-6)


@given(seeds)
@settings(max_examples=examples(20), deadline=None)
def test_the_hessian_is_that_of_the_gradient_and_symmetric(seed: int) -> None:
    x = shaken(seed)
    direction = np.random.default_rng(seed + 1).normal(size=X.shape)
    h = 1e-7
    slope = (SHEET.gradient(x + h * direction) - SHEET.gradient(x - h * direction)) / (2 * h)
    K = SHEET.hessian(x)
    assert K @ direction.ravel() == pytest.approx(slope, rel=1e-4, abs=1e-4 * np.abs(slope).max())
    assert abs(K - K.T).max() < 1e-12 * abs(K).max()


@given(seeds)
@settings(max_examples=examples(20), deadline=None)
def test_moving_and_turning_the_sheet_costs_nothing(seed: int) -> None:
    x = shaken(seed)
    assert np.abs(SHEET.gradient(x) @ rigid_motions(x)).max() < 1e-10
    turned, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    assert SHEET.energy(x @ turned.T + 0.7) == pytest.approx(SHEET.energy(x), rel=1e-9)
