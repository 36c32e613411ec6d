from __future__ import annotations

import pytest
import scipy.sparse as sp

from cohaptic.errors import BodyError
from cohaptic_server.cholesky.factorise import factorise
from tests.server.cholesky.block_problem import on_surface, problem


def test_progress_rises_to_one() -> None:
    matrix, points = problem()
    shares: list[float] = []
    factorise(matrix, points, on_surface(points), shares.append)
    assert shares == sorted(shares)
    assert (shares[0] < 0.2, shares[-1]) == (True, 1.0)


def test_an_indefinite_matrix_is_refused() -> None:
    matrix, points = problem()
    with pytest.raises(BodyError, match="not positive definite"):
        factorise(sp.csr_array(-matrix), points, on_surface(points))
