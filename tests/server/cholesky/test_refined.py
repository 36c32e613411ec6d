from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic_server.cholesky.blocks import multiply
from cohaptic_server.cholesky.refactor import Indefinite
from cohaptic_server.cholesky.refined import Refined, Workspaces
from cohaptic_server.cholesky.symbolic import analyse
from cohaptic_server.numeric import Floats
from tests.examples_of_laws import examples
from tests.server.cholesky.block_problem import blocks_of, dense, grid, shifted

ELEMENTS, POINTS = grid(4)
ANALYSIS = analyse(ELEMENTS, POINTS, leaf=8)


def test_the_product_is_that_of_the_dense_matrix() -> None:
    rng = np.random.default_rng(5)
    blocks = rng.normal(size=(len(ANALYSIS.rows), 3, 3))
    on_diagonal = ANALYSIS.starts[:-1]
    blocks[on_diagonal] += blocks[on_diagonal].swapaxes(1, 2)
    flat, x = blocks.reshape(-1, 9), rng.normal(size=(ANALYSIS.size, 3))
    out = np.full_like(x, np.nan)
    multiply(flat, ANALYSIS.starts, ANALYSIS.rows, x[ANALYSIS.dof], out)
    assert out == pytest.approx((dense(ANALYSIS, flat) @ x)[ANALYSIS.dof], rel=1e-12, abs=1e-12)


@given(st.integers(0, 2**32 - 1), st.floats(-6.0, 1.0), st.floats(-12.0, 12.0))
@settings(max_examples=examples(30), deadline=None)
def test_it_is_as_exact_as_double_precision(seed: int, least: float, scale: float) -> None:
    """Also for matrices whose condition single precision cannot take, and for any unit."""
    K: Floats = np.asarray(
        10.0**scale * shifted(ELEMENTS, len(POINTS), seed, 10.0**least), dtype=np.float64
    )
    b = np.random.default_rng(seed).normal(size=(ANALYSIS.size, 2))
    b[:, 1] = 0.0
    found = Refined(Workspaces(ANALYSIS), blocks_of(ANALYSIS, K)).checked(b[ANALYSIS.dof])
    expected: Floats = np.asarray(np.linalg.solve(K, b)[ANALYSIS.dof], dtype=np.float64)
    error = np.abs(found - expected).max()
    assert error < (1e-7 if least > -2.0 else 1e-4) * np.abs(expected).max()
    assert (found[:, 1] == 0.0).all()


@given(st.integers(0, 2**32 - 1), st.floats(-9.0, 0.0))
@settings(max_examples=examples(30), deadline=None)
def test_no_matrix_passes_for_positive_definite_by_rounding(seed: int, least: float) -> None:
    """Its lowest mode is negative, by as little as a millionth of what single precision sees."""
    K = shifted(ELEMENTS, len(POINTS), seed, -(10.0**least))
    b = np.random.default_rng(seed).normal(size=(ANALYSIS.size, 2))
    with pytest.raises(Indefinite):
        Refined(Workspaces(ANALYSIS), blocks_of(ANALYSIS, K)).checked(b)


def test_what_was_found_good_goes_on_answering() -> None:
    """`solve` and `approximate` always have an answer; the second one to single precision."""
    K = shifted(ELEMENTS, len(POINTS), 0, 0.5)
    b = np.random.default_rng(0).normal(size=(ANALYSIS.size, 5))
    factor = Refined(Workspaces(ANALYSIS), blocks_of(ANALYSIS, K))
    expected = np.linalg.solve(K, b)[ANALYSIS.dof]
    largest = np.abs(expected).max()
    assert factor.solve(b[ANALYSIS.dof]) == pytest.approx(expected, abs=1e-9 * largest)
    assert factor.approximate(b[ANALYSIS.dof]) == pytest.approx(expected, abs=1e-3 * largest)
