from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic_server.bodies.solid.stiffness import stiffness
from cohaptic_server.cholesky.refactor import Indefinite, Refactored
from cohaptic_server.cholesky.symbolic import analyse
from cohaptic_server.numeric import Floats
from cohaptic_server.testing.blocks import block


def held_block(cells: tuple[int, int, int], nu: float) -> tuple[sp.csr_array, Floats]:
    """Stiffness of a block whose foot is held, and the places of its free nodes."""
    mesh = block((0.1, 0.08, 0.06), cells)
    free = mesh.vertices[:, 2] > 0.0
    dof = np.flatnonzero(np.repeat(free, 3))
    K = stiffness(mesh, mesh.tets, len(mesh.vertices), 1e4, nu)
    K = sp.csr_array(K[dof][:, dof])
    # Entries that cancel to zero on one side only are kept on both.
    pattern = sp.csr_array(abs(K) + abs(K.T))
    rows, columns = _rows(pattern), pattern.indices
    data = K.toarray()[rows, columns]
    return sp.csr_array((data, columns, pattern.indptr), shape=K.shape), mesh.vertices[free]


@pytest.mark.parametrize("cells", [(1, 1, 1), (3, 2, 4), (7, 5, 4)])
@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=8, deadline=None)
def test_one_analysis_serves_every_matrix_of_its_pattern(
    cells: tuple[int, int, int], seed: int
) -> None:
    """Against a dense solve; meshes of one leaf and of many."""
    K, points = held_block(cells, 0.45)
    analysis, rng = analyse(K, points), np.random.default_rng(seed)
    for _ in range(2):
        scale = rng.uniform(0.5, 2.0, analysis.size)
        data = K.data * scale[_rows(K)] * scale[K.indices]
        b = rng.normal(size=(analysis.size, 3))
        found = Refactored(analysis, data[analysis.entries]).solve(b)
        expected = np.linalg.solve(K.toarray() * np.outer(scale, scale), b)
        assert found == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())


def _rows(K: sp.csr_array) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    return np.repeat(np.arange(len(K.indptr) - 1), np.diff(K.indptr))


def test_each_pair_of_mirror_images_is_read_once() -> None:
    K, points = held_block((4, 4, 4), 0.3)
    analysis = analyse(K, points)
    rows, columns = _rows(K)[analysis.entries], K.indices[analysis.entries]
    pairs = {frozenset(p) for p in zip(rows.tolist(), columns.tolist(), strict=True)}
    assert len(pairs) == len(rows) == (K.nnz + analysis.size) // 2


def test_an_indefinite_matrix_is_found_out() -> None:
    K, points = held_block((4, 4, 4), 0.3)
    analysis = analyse(K, points)
    lowest = np.linalg.eigvalsh(K.toarray())[0]
    rows = _rows(K)
    for share, stable in ((0.9, True), (1.1, False)):
        data = K.data - share * lowest * (rows == K.indices)
        if stable:
            assert Refactored(analysis, data[analysis.entries]).bytes > 0
        else:
            with pytest.raises(Indefinite):
                Refactored(analysis, data[analysis.entries])
