from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp

from cohaptic.errors import BodyError
from cohaptic_server.bodies.solid.parts import stiffness_of
from cohaptic_server.bodies.solid.shape import SolidSettings, shape_of
from cohaptic_server.cholesky.factorise import factorise
from cohaptic_server.cholesky.plan import plan_of
from cohaptic_server.cholesky.symbolic import graph_of
from cohaptic_server.testing.blocks import block
from tests.server.cholesky.block_problem import on_surface, problem


def test_an_indefinite_matrix_is_refused() -> None:
    matrix, points = problem()
    with pytest.raises(BodyError, match="not positive definite"):
        factorise(sp.csr_array(-matrix), points, on_surface(points))


def test_strands_that_nothing_connects_are_told_apart_without_a_word(
    capfd: pytest.CaptureFixture[str],
) -> None:
    """As in a knot: what parts two strands there has no unknowns, and BLAS complains of none."""
    strand = block((0.02, 0.02, 1.5), (2, 2, 300))
    shape = shape_of(strand, strand.vertices[:, 2] <= 0.0, SolidSettings(order=1))
    free = np.flatnonzero(~shape.fixed)
    dof = (3 * free[:, None] + np.arange(3)).ravel()
    matrix = sp.csr_array(stiffness_of(shape)[dof][:, dof])
    points = np.concatenate([shape.nodes[free] + [x, 0.0, 0.0] for x in (0.0, 0.03)])
    both, every = sp.csr_array(sp.block_diag([matrix, matrix])), np.ones(len(points), np.bool_)
    plan = plan_of(graph_of(both), points, every)
    assert any(len(b) and not len(p.own) for p, b in zip(plan.parts, plan.borders, strict=True))
    factor = factorise(both, points, every, plan=plan)
    force = np.array([[0.0], [1.0], [0.0]])
    load = np.zeros(both.shape[0])
    load[-2] = 1.0
    moved = factor.solve(np.array([len(points) - 1]), force)[:, 0]
    assert np.abs(both @ moved - load).max() < 1e-9
    assert capfd.readouterr() == ("", "")
