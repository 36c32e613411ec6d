from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp
import scipy.sparse.linalg

from cohaptic_server.cholesky import factorise as factorising
from cohaptic_server.cholesky.factor import Factor
from cohaptic_server.cholesky.factorise import factorise
from cohaptic_server.numeric import Floats
from tests.server.cholesky.block_problem import on_surface, problem

PRESSES = 40


def factor() -> Factor:
    matrix, points = problem()
    return factorise(matrix, points, on_surface(points))


def fractions() -> sp.csr_array:
    """Presses on a few random nodes of the surface each; the last one has none."""
    _, points = problem()
    rng = np.random.default_rng(3)
    nodes = np.flatnonzero(on_surface(points))
    table = np.zeros((len(points), PRESSES))
    for press in range(PRESSES - 1):
        table[rng.choice(nodes, 1 + press % 7, replace=False), press] = rng.uniform(0.1, 1.0)
    return sp.csr_array(table)


def expected() -> Floats:
    """The compliance between all of them by a general solver, shape (3 r, 3 r)."""
    matrix, _ = problem()
    forces = sp.kron(fractions(), sp.eye_array(3)).toarray()
    return np.asarray(forces.T @ scipy.sparse.linalg.spsolve(matrix.tocsc(), forces))


def test_compliances_are_those_of_a_general_solver() -> None:
    exact = expected()
    mutual = factorising.mutual_compliance(factor(), fractions())
    assert np.abs(mutual - exact).max() < 1e-11 * np.abs(exact).max()
    own = factorising.self_compliance(factor(), fractions())
    blocks = exact.reshape(PRESSES, 3, PRESSES, 3)[np.arange(PRESSES), :, np.arange(PRESSES)]
    assert np.abs(own - blocks).max() < 1e-11 * np.abs(exact).max()
    assert np.array_equal(own, own.transpose(0, 2, 1))
    assert np.linalg.eigvalsh(own[:-1]).min() > 0.0
    assert not own[-1].any()


def test_a_press_alone_has_what_it_has_among_others() -> None:
    together = factorising.self_compliance(factor(), fractions())
    for press in range(0, PRESSES, 9):
        alone = factorising.self_compliance(factor(), sp.csr_array(fractions()[:, [press]]))
        assert alone[0] == pytest.approx(together[press], rel=1e-12)
