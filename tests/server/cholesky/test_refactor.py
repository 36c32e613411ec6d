from __future__ import annotations

import gc

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic_server.cholesky.refactor import Indefinite, Refactored, Workspace
from cohaptic_server.cholesky.symbolic import analyse
from tests.examples_of_laws import examples
from tests.server.cholesky.block_problem import blocks_of, dense, grid, shifted

sizes, seeds = st.integers(2, 5), st.integers(0, 2**32 - 1)


@given(sizes, st.integers(2, 30), seeds)
@settings(max_examples=examples(20), deadline=None)
def test_one_workspace_serves_every_matrix_of_its_pattern(n: int, leaf: int, seed: int) -> None:
    """Against a dense solve; trees of one front and of many, in both precisions."""
    elements, points = grid(n)
    analysis, rng = analyse(elements, points, leaf=leaf), np.random.default_rng(seed)
    for single, tolerance in ((False, 1e-9), (True, 1e-2)):
        workspace = Workspace(analysis, single=single)
        for _ in range(2):
            K = shifted(elements, len(points), seed, 2.0)
            b = rng.normal(size=(analysis.size, 3))
            found = Refactored(workspace, blocks_of(analysis, K)).solve(b[analysis.dof])
            expected = np.linalg.solve(K, b)[analysis.dof]
            assert found == pytest.approx(expected, abs=tolerance * np.abs(expected).max())


def test_a_factor_in_use_is_not_overwritten_and_its_memory_is_used_again() -> None:
    elements, points = grid(4)
    analysis = analyse(elements, points, leaf=8)
    workspace, b = Workspace(analysis), np.ones((analysis.size, 1))
    blocks = [blocks_of(analysis, shifted(elements, len(points), k, 1.0)) for k in range(3)]
    first = Refactored(workspace, blocks[0])
    kept = first.solve(b)
    second = Refactored(workspace, blocks[1])
    assert (first.solve(b) == kept).all()
    assert not (second.solve(b) == kept).any()
    del second
    gc.collect()
    assert (Refactored(workspace, blocks[2]).solve(b) != kept).all()
    assert (first.solve(b) == kept).all()


@given(sizes, seeds)
@settings(max_examples=examples(10), deadline=None)
def test_a_root_that_is_left_is_its_schur_complement(n: int, seed: int) -> None:
    elements, points = grid(n)
    analysis = analyse(elements, points, root=np.arange(n), leaf=4)
    K = shifted(elements, len(points), seed, 1.0)
    factor = Refactored(Workspace(analysis), blocks_of(analysis, K), without_root=True)
    at = 3 * analysis.fronts[-1].first
    ordered = K[np.ix_(analysis.dof, analysis.dof)]
    inner, across = ordered[:at, :at], ordered[:at, at:]
    expected = ordered[at:, at:] - across.T @ np.linalg.solve(inner, across)
    assert np.tril(factor.root) == pytest.approx(np.tril(expected), abs=1e-8)


def test_each_pair_of_mirror_images_is_read_once() -> None:
    elements, points = grid(4)
    analysis = analyse(elements, points, leaf=8)
    K = shifted(elements, len(points), 0, 1.0)
    assert (dense(analysis, blocks_of(analysis, K)) == K).all()
    assert 9 * len(analysis.rows) == (np.count_nonzero(K) + 9 * len(points)) // 2
    pairs = analysis.blocks_of(np.array([[5, 0, -1]]))
    K[:3, 15:18] = np.arange(9).reshape(3, 3)
    K[15:18, :3] = K[:3, 15:18].T
    block = blocks_of(analysis, K)[pairs[0, 1] if pairs[0, 1] >= 0 else -1 - pairs[0, 1]]
    block = block.reshape(3, 3) if pairs[0, 1] >= 0 else block.reshape(3, 3).T
    assert (block == K[:3, 15:18]).all()
    assert (pairs[0, 3:] == len(analysis.rows)).all()


def test_an_indefinite_matrix_is_found_out() -> None:
    elements, points = grid(4)
    analysis = analyse(elements, points, leaf=8)
    for least, stable in ((0.05, True), (-0.05, False)):
        blocks = blocks_of(analysis, shifted(elements, len(points), 1, least))
        if stable:
            assert Refactored(Workspace(analysis), blocks).bytes > 0
        else:
            with pytest.raises(Indefinite):
                Refactored(Workspace(analysis), blocks)
