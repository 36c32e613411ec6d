from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic_server.bodies.balloon.membrane import Membrane
from cohaptic_server.bodies.balloon.tension_field import (
    ENTRIES,
    MembraneStrain,
    energy_density,
    membrane_strain,
    moduli,
    stress,
)
from cohaptic_server.numeric import Floats

seeds = st.integers(0, 2**32 - 1)


def some(seed: int, low: float = 0.3, high: float = 2.5, m: int = 40) -> Floats:
    """Deformation gradients with stretches from `low` to `high` in any directions, (2, 3, m)."""
    rng = np.random.default_rng(seed)
    frames = np.linalg.qr(rng.normal(size=(m, 3, 3)))[0][:, :, :2]
    turns = np.linalg.qr(rng.normal(size=(m, 2, 2)))[0]
    F = np.einsum("mai,mi,mip->map", frames, rng.uniform(low, high, (m, 2)), turns)
    return np.ascontiguousarray(F.transpose(2, 1, 0))


def far_from_a_change(state: MembraneStrain) -> npt.NDArray[np.bool_]:
    """Triangles whose Hessian does not jump nearby."""
    c1, c2 = state.c
    gap = np.minimum(np.abs(c1 * c2 * c2 - 1.0), np.abs(c1 - 1.0))
    return np.asarray(gap > 0.02)


def full(state: MembraneStrain) -> Floats:
    """The moduli as matrices, shape (m, 6, 6) with rows (p, a)."""
    values = moduli(state)
    A = np.zeros((values.shape[1], 2, 3, 2, 3))
    for value, (p, a, q, b) in zip(values, ENTRIES, strict=True):
        A[:, p, a, q, b] = A[:, q, b, p, a] = value
    return A.reshape(-1, 6, 6)


@given(seeds)
@settings(max_examples=20, deadline=None)
def test_stress_is_the_derivative_of_the_energy(seed: int) -> None:
    F, rng, h = some(seed), np.random.default_rng(seed), 1e-6
    way = rng.normal(size=F.shape)
    slope = (
        energy_density(membrane_strain(F + h * way)) - energy_density(membrane_strain(F - h * way))
    ) / (2 * h)
    expected = (stress(membrane_strain(F)) * way).sum(axis=(0, 1))
    assert expected == pytest.approx(slope, rel=1e-5, abs=1e-6 * np.abs(slope).max())


@given(seeds)
@settings(max_examples=20, deadline=None)
def test_moduli_are_the_derivative_of_the_stress(seed: int) -> None:
    F, rng, h = some(seed), np.random.default_rng(seed), 1e-6
    state = membrane_strain(F)
    way = rng.normal(size=F.shape)
    change = (stress(membrane_strain(F + h * way)) - stress(membrane_strain(F - h * way))) / (2 * h)
    found = np.einsum("mij,jm->im", full(state), way.reshape(6, -1)).reshape(F.shape)
    clear = far_from_a_change(state)
    assert np.abs(found - change)[..., clear].max() < 1e-4 * np.abs(change).max()


@given(seeds)
@settings(max_examples=20, deadline=None)
def test_the_energy_is_convex_in_every_state(seed: int) -> None:
    """No element can take energy out of the tangent: taut, wrinkled, slack, or nearly a line."""
    state = membrane_strain(some(seed, low=1e-4))
    values = np.linalg.eigvalsh(full(state))
    assert values.min() > -1e-10 * values.max()
    c1, c2 = state.c
    assert (state.taut == (c1 * c2 * c2 > 1.0)).all()
    tension = np.einsum("pam,pam->m", stress(state), state.columns)
    assert np.isfinite(tension).all()


def test_taut_rubber_is_that_of_the_membrane() -> None:
    """One triangle stretched in two directions."""
    x = np.array([[0.0, 0.0, 0.0], [1.0, 0.2, 0.1], [0.3, 0.9, -0.2]])
    sheet = Membrane.at_rest(x, np.array([[0, 1, 2]]), 3.0)
    moved = x @ np.array([[1.6, 0.2, 0.0], [0.1, 1.3, 0.0], [0.0, 0.3, 1.4]])
    F = np.einsum("ka,kp->pa", moved, sheet.gradients[0])[:, :, None]
    state = membrane_strain(F)
    assert state.taut.all()
    assert 3.0 * sheet.rest_area @ energy_density(state) == pytest.approx(sheet.energy(moved))


def test_a_slack_sheet_is_free_and_a_wrinkled_one_pulls_one_way_only() -> None:
    F = np.zeros((2, 3, 3))
    F[0, 0] = [0.5, 2.0, 2.0]  # along x
    F[1, 1] = [0.9, 0.1, 0.7]  # along y
    F[1, 1, 2] = 2.0**-0.5 + 1e-9  # just wide enough to be without wrinkles
    state = membrane_strain(F)
    assert state.taut.tolist() == [False, False, True]
    P = stress(state)
    assert np.abs(P[..., 0]).max() == 0.0
    assert P[0, 0, 1] == pytest.approx(2.0 - 2.0**-2.0)  # lambda - lambda^-2, uniaxial
    assert np.abs(P[1, :, 1]).max() == 0.0
    # No jump of force or energy on the way into wrinkles.
    assert P[..., 2] == pytest.approx(P[..., 1], abs=1e-7)
    density = energy_density(state)
    assert density[1] == pytest.approx(density[2], rel=1e-9)
