from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic_server.bodies.balloon.tension_field import add_forces, add_tangents, energy, strains
from cohaptic_server.numeric import Floats, Ints
from tests.examples_of_laws import examples

seeds = st.integers(0, 2**32 - 1)

# A triangle whose second and third corner, the first at zero, are the columns of F.
_CORNER = np.array([[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]])


def some(seed: int, low: float = 0.3, high: float = 2.5, m: int = 20) -> Floats:
    """Deformation gradients with stretches from `low` to `high` in any directions, (2, 3, m)."""
    rng = np.random.default_rng(seed)
    frames = np.linalg.qr(rng.normal(size=(m, 3, 3)))[0][:, :, :2]
    turns = np.linalg.qr(rng.normal(size=(m, 2, 2)))[0]
    F = np.einsum("mai,mi,mip->map", frames, rng.uniform(low, high, (m, 2)), turns)
    return np.ascontiguousarray(F.transpose(2, 1, 0))


def triangles(count: int) -> tuple[Ints, Floats]:
    """Triangles without a common corner, and the gradients of their shape functions."""
    return np.arange(3 * count).reshape(-1, 3), np.tile(_CORNER, (count, 1, 1))


def strained(F: Floats) -> Floats:
    """Strains of the deformation gradients, shape (m, 10)."""
    m = F.shape[2]
    x = np.zeros((m, 3, 3))
    x[:, 1:] = F.transpose(2, 0, 1)
    out = np.empty((m, 10))
    strains(x.reshape(-1, 3), *triangles(m), out)
    return out


def density(F: Floats) -> Floats:
    """W / (mu h), shape (m,)."""
    return np.array([energy(row[None], np.ones(1)) for row in strained(F)])


def stress(F: Floats) -> Floats:
    """dW/dF / (mu h), shape (2, 3, m)."""
    m: int = F.shape[2]
    out = np.zeros((3 * m, 3))
    add_forces(strained(F), *triangles(m), np.ones(m), out)
    forces = out.reshape(m, 3, 3)
    assert np.abs(forces.sum(axis=1)).max() < 1e-12 * max(1.0, np.abs(forces).max())
    return forces[:, 1:].transpose(1, 2, 0)


def full(F: Floats) -> Floats:
    """The moduli as matrices, shape (m, 6, 6) with rows (p, a)."""
    m: int = F.shape[2]
    pairs: Ints = np.arange(6 * m).reshape(m, 6)
    pairs[::2, 4] = -1 - pairs[::2, 4]  # some blocks are those of the transpose
    blocks = np.zeros((6 * m, 9))
    add_tangents(strained(F), triangles(m)[1], np.ones(m), pairs, 6 * m, np.empty(6), blocks)
    stack = blocks.reshape(m, 6, 3, 3)
    stack[::2, 4] = stack[::2, 4].swapaxes(1, 2)
    A = np.zeros((m, 2, 3, 2, 3))
    A[:, 0, :, 0], A[:, 1, :, 1], A[:, 1, :, 0] = stack[:, 2], stack[:, 5], stack[:, 4]
    A[:, 0, :, 1] = stack[:, 4].swapaxes(1, 2)
    return A.reshape(-1, 6, 6)


def far_from_a_change(F: Floats) -> npt.NDArray[np.bool_]:
    """Triangles whose Hessian does not jump nearby."""
    c1, c2 = strained(F)[:, 8:].T
    gap = np.minimum(np.abs(c1 * c2 * c2 - 1.0), np.abs(c1 - 1.0))
    return np.asarray(gap > 0.02)


@given(seeds)
@settings(max_examples=examples(20), deadline=None)
def test_stress_is_the_derivative_of_the_energy(seed: int) -> None:
    F, rng, h = some(seed), np.random.default_rng(seed), 1e-6
    way = rng.normal(size=F.shape)
    slope = (density(F + h * way) - density(F - h * way)) / (2 * h)
    expected = (stress(F) * way).sum(axis=(0, 1))
    assert expected == pytest.approx(slope, rel=1e-5, abs=1e-6 * np.abs(slope).max())


@given(seeds)
@settings(max_examples=examples(20), deadline=None)
def test_moduli_are_the_derivative_of_the_stress(seed: int) -> None:
    F, rng, h = some(seed), np.random.default_rng(seed), 1e-6
    way = rng.normal(size=F.shape)
    change = (stress(F + h * way) - stress(F - h * way)) / (2 * h)
    found = np.einsum("mij,jm->im", full(F), way.reshape(6, -1)).reshape(F.shape)
    clear = far_from_a_change(F)
    assert np.abs(found - change)[..., clear].max() < 1e-4 * np.abs(change).max()


@given(seeds)
@settings(max_examples=examples(20), deadline=None)
def test_the_energy_is_convex_in_every_state(seed: int) -> None:
    """No element can take energy out of the tangent: taut, wrinkled, slack, or nearly a line."""
    F = some(seed, low=1e-4)
    values = np.linalg.eigvalsh(full(F))
    assert values.min() > -1e-10 * values.max()
    assert np.isfinite(stress(F)).all()


def test_a_slack_sheet_is_free_and_a_wrinkled_one_pulls_one_way_only() -> None:
    F = np.zeros((2, 3, 3))
    F[0, 0] = [0.5, 2.0, 2.0]  # along x
    F[1, 1] = [0.9, 0.1, 0.7]  # along y
    F[1, 1, 2] = 2.0**-0.5 + 1e-9  # just wide enough to be without wrinkles
    c1, c2 = strained(F)[:, 8:].T
    assert (c1 * c2 * c2 > 1.0).tolist() == [False, False, True]
    P = stress(F)
    assert np.abs(P[..., 0]).max() == 0.0
    assert P[0, 0, 1] == pytest.approx(2.0 - 2.0**-2.0)  # lambda - lambda^-2, uniaxial
    assert np.abs(P[1, :, 1]).max() == 0.0
    # No jump of force or energy on the way into wrinkles.
    assert P[..., 2] == pytest.approx(P[..., 1], abs=1e-7)
    W = density(F)
    assert W[1] == pytest.approx(W[2], rel=1e-9)
