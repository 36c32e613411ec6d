from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic_server.mesh.enclosed_volume import scatter_matrix, scatter_vector
from cohaptic_server.mesh.icosphere import icosphere
from tests.examples_of_laws import examples

X, FACES = icosphere(1, 0.1)
N, M = len(X), len(FACES)
seeds = st.integers(0, 2**32 - 1)


@given(seeds)
@settings(max_examples=examples(20), deadline=None)
def test_each_corner_gets_its_share_and_nothing_is_lost(seed: int) -> None:
    fractions = np.random.default_rng(seed).normal(size=(M, 3, 3))
    whole = scatter_vector(fractions, FACES, N).reshape(N, 3)
    assert whole.sum(axis=0) == pytest.approx(fractions.sum(axis=(0, 1)))
    for vertex in (0, N // 2, N - 1):
        assert whole[vertex] == pytest.approx(fractions[vertex == FACES].sum(axis=0))


@given(seeds)
@settings(max_examples=examples(20), deadline=None)
def test_a_matrix_does_to_the_whole_what_its_blocks_do_to_the_parts(seed: int) -> None:
    """K u, assembled, is the sum over faces of (block of the face) (u at its corners)."""
    rng = np.random.default_rng(seed)
    blocks, u = rng.normal(size=(M, 3, 3, 3, 3)), rng.normal(size=(N, 3))
    parts = np.einsum("mijkl,mkl->mij", blocks, u[FACES])
    whole = scatter_matrix(blocks, FACES, N) @ u.ravel()
    # Six faces of three corners meet at a vertex: rounding of a sum of 54 products.
    assert whole == pytest.approx(scatter_vector(parts, FACES, N), abs=1e-12)
