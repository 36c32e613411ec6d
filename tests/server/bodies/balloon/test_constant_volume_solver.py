from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from cohaptic_server.bodies.balloon.balloon import BalloonSettings, inflate
from cohaptic_server.bodies.balloon.rubber_balloon import (
    ConstantVolumeFactor,
)
from cohaptic_server.bodies.hyperelastic import IndefiniteTangentError
from cohaptic_server.cholesky.refactor import Workspace
from cohaptic_server.cholesky.symbolic import analyse
from cohaptic_server.mesh.enclosed_volume import volume_hessian
from cohaptic_server.numeric import Floats, Ints
from tests.examples_of_laws import examples
from tests.server.cholesky.block_problem import blocks_of, grid, shifted


def factor(
    K: Floats, elements: Ints, points: Floats, g: Floats, root: Ints
) -> tuple[ConstantVolumeFactor, Ints]:
    """The factor of K, its nodes in the order of `points`, and the order of its unknowns."""
    analysis = analyse(elements, points, root=root, leaf=6)
    blocks = blocks_of(analysis, K)
    return ConstantVolumeFactor(Workspace(analysis), blocks, g[analysis.dof]), analysis.dof


@example(n=4, fraction=0.625, seed=27973640)  # parts that do not touch
@given(st.integers(3, 5), st.floats(0.01, 0.9), st.integers(0, 2**32 - 1))
@settings(max_examples=examples(30), deadline=None)
def test_it_solves_the_bordered_system(n: int, fraction: float, seed: int) -> None:
    """With any cap."""
    elements, points = grid(n)
    K, rng = shifted(elements, len(points), seed, 0.5), np.random.default_rng(seed)
    g, b = rng.normal(size=len(K)), rng.normal(size=(3, len(K)))
    cap = rng.permutation(len(points))[: max(1, round(fraction * len(points)))]
    solver, order = factor(K, elements, points, g, cap)
    found, q = solver.solve(b[:, order])
    u = np.empty_like(found)
    u[:, order] = found
    assert np.abs(u @ g).max() < 1e-8 * np.abs(u).max() * np.abs(g).max()
    assert u @ K + q[:, None] * g == pytest.approx(b, abs=1e-8)


def test_a_negative_mode_that_the_water_forbids_does_no_harm_and_others_are_found() -> None:
    """The inflated balloon, past its pressure maximum; then with more pressure than holds it."""
    inflated = inflate(BalloonSettings(subdivisions=2))
    free = inflated.x[:, 2] >= -0.085
    number = np.where(free, np.cumsum(free) - 1, -1)
    dof = np.flatnonzero(np.repeat(free, 3))
    K = inflated.stiffness[dof][:, dof].toarray()
    g, elements, points = inflated.volume_gradient[dof], number[inflated.faces], inflated.x[free]
    assert np.linalg.eigvalsh(K)[0] < 0.0
    b = np.random.default_rng(0).normal(size=(1, len(dof)))
    cap = np.argsort(points[:, 2])[-20:]
    solver, order = factor(K, elements, points, g, cap)
    u, q = solver.solve(b[:, order])
    bordered = np.block([[K, g[:, None]], [g[None], np.zeros((1, 1))]])
    expected = np.linalg.solve(bordered, np.append(b, 0.0))
    assert u[0] == pytest.approx(expected[order], abs=1e-9 * np.abs(u).max())
    assert q[0] == pytest.approx(expected[-1], rel=1e-9)
    follower = volume_hessian(inflated.x, inflated.faces)[dof][:, dof].toarray()
    with pytest.raises(IndefiniteTangentError):
        factor(K - 2.0 * inflated.pressure * follower, elements, points, g, cap)
