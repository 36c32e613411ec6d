from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic_server.bodies.balloon.balloon import BalloonSettings, inflate
from cohaptic_server.bodies.balloon.constant_volume_solver import (
    BandPattern,
    ConstantVolumeFactor,
    narrow_band_order,
)
from cohaptic_server.bodies.hyperelastic import IndefiniteTangentError
from cohaptic_server.mesh.enclosed_volume import volume_hessian
from cohaptic_server.mesh.icosphere import icosphere
from cohaptic_server.numeric import Floats


def banded(size: int, width: int, seed: int, shift: float) -> Floats:
    """A random symmetric matrix of a band, its smallest eigenvalue at `shift`."""
    rng = np.random.default_rng(seed)
    K = rng.normal(size=(size, size))
    K = np.triu(np.tril(K + K.T, width), -width)
    return np.asarray(K + (shift - np.linalg.eigvalsh(K)[0]) * np.eye(size))


def factor(K: Floats, width: int, g: Floats) -> ConstantVolumeFactor:
    i = np.arange(len(K))
    rows, columns = np.nonzero((i[:, None] >= i) & (i[:, None] - i <= width))
    return ConstantVolumeFactor(BandPattern(rows, columns, len(K)), K[rows, columns], g)


@given(st.integers(4, 60), st.integers(1, 50), st.integers(0, 2**32 - 1))
@settings(max_examples=60, deadline=None)
def test_it_solves_the_bordered_system(size: int, width: int, seed: int) -> None:
    width = min(width, size - 1)
    K, rng = banded(size, width, seed, 0.5), np.random.default_rng(seed)
    g, b = rng.normal(size=size), rng.normal(size=(3, size))
    u, q = factor(K, width, g).solve(b)
    assert np.abs(u @ g).max() < 1e-8 * np.abs(u).max() * np.abs(g).max()
    assert u @ K + q[:, None] * g == pytest.approx(b, abs=1e-8)


def test_a_negative_mode_that_the_water_forbids_does_no_harm_and_others_are_found() -> None:
    """The inflated balloon, past its pressure maximum; then with more pressure than holds it."""
    inflated = inflate(BalloonSettings(subdivisions=2))
    free = inflated.x[:, 2] >= -0.085
    order = narrow_band_order(inflated.faces, free)
    dof = (3 * order[:, None] + np.arange(3)).ravel()
    K = inflated.stiffness[dof][:, dof].toarray()
    g, size = inflated.volume_gradient[dof], len(dof)
    assert np.linalg.eigvalsh(K)[0] < 0.0
    b = np.random.default_rng(0).normal(size=(1, size))
    width = int(np.subtract(*np.nonzero(K)).max())
    u, q = factor(K, width, g).solve(b)
    bordered = np.block([[K, g[:, None]], [g[None], np.zeros((1, 1))]])
    expected = np.linalg.solve(bordered, np.append(b, 0.0))
    assert u[0] == pytest.approx(expected[:-1], abs=1e-9 * np.abs(u).max())
    assert q[0] == pytest.approx(expected[-1], rel=1e-9)
    follower = volume_hessian(inflated.x, inflated.faces)[dof][:, dof].toarray()
    with pytest.raises(IndefiniteTangentError):
        factor(K - 2.0 * inflated.pressure * follower, width, g)


def test_the_order_begins_at_the_base_and_names_every_free_vertex_once() -> None:
    x, faces = icosphere(2, 1.0)
    free = x[:, 2] > -0.8
    order = narrow_band_order(faces, free)
    assert sorted(order.tolist()) == np.flatnonzero(free).tolist()
    height = x[order, 2]
    assert height[:20].mean() < -0.4
    assert height[-20:].mean() > 0.6
