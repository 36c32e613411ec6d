from __future__ import annotations

import numpy as np
import scipy.sparse.linalg

from cohaptic_server.cholesky.factorise import factorise
from tests.server.cholesky.block_problem import in_single, on_surface, problem


def test_it_solves_as_a_general_solver_does() -> None:
    matrix, points = problem()
    forces = np.random.default_rng(0).normal(size=(matrix.shape[0], 2))
    factor = factorise(matrix, points, np.ones(len(points), dtype=np.bool_))
    x = factor.solve(np.arange(len(points)), forces)
    exact = scipy.sparse.linalg.spsolve(matrix.tocsc(), forces)
    assert np.abs(x - exact).max() < 1e-10 * np.abs(exact).max()


def test_a_few_nodes_are_solved_for_as_all_are() -> None:
    matrix, points = problem()
    retained = on_surface(points)
    factor = factorise(matrix, points, retained)
    nodes = np.flatnonzero(retained)
    forces = np.random.default_rng(1).normal(size=(6, 3))
    rows = (3 * nodes[-3:, None] + np.arange(3)).ravel()
    few = factor.solve(nodes[:2], forces, nodes[-3:])[rows]
    assert np.array_equal(few, factor.solve(nodes[:2], forces)[rows])
    half = in_single(factor)
    assert half.bytes == factor.bytes // 2
    rounded = half.solve(nodes[:2], forces)[rows]
    assert np.abs(rounded - few).max() < 1e-4 * np.abs(few).max()
