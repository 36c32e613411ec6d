"""The factor against a general sparse solver, and what its short cuts keep."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp
import scipy.sparse.linalg

from cohaptic.errors import BodyError
from cohaptic_server.bodies.blocks import block
from cohaptic_server.bodies.elements import stiffness
from cohaptic_server.bodies.mesh import Floats, Ints
from cohaptic_server.bodies.multifrontal import Factor
from cohaptic_server.bodies.tetrahedra import boundary


class Block:
    """A block that stands on its foot, with what is inside and what is not."""

    def __init__(self) -> None:
        mesh = block((0.1, 0.06, 0.05), (10, 7, 6))
        free = np.flatnonzero(mesh.vertices[:, 2] > 1e-9)
        place = np.full(len(mesh.vertices), -1)
        place[free] = np.arange(len(free))
        dof = (3 * free[:, None] + np.arange(3)).ravel()
        K = stiffness(mesh, mesh.tets, len(mesh.vertices), 1e4, 0.4)
        self.matrix = sp.csr_array(K[dof][:, dof])
        self.points = mesh.vertices[free]
        surface = place[np.unique(boundary(mesh.tets))]
        self.wanted = np.zeros(len(free), dtype=np.bool_)
        self.wanted[surface[surface >= 0]] = True
        self.surface: Ints = np.flatnonzero(self.wanted)
        self.factor = Factor(self.matrix, self.points, self.wanted)


@pytest.fixture(scope="module")
def case() -> Block:
    return Block()


def pushes(case: Block, count: int) -> tuple[Ints, Floats]:
    random = np.random.default_rng(5)
    nodes = random.choice(case.surface, count, replace=False)
    return nodes, random.standard_normal((3 * count, 4))


def rows(nodes: Ints) -> Ints:
    return np.asarray((3 * nodes[:, None] + np.arange(3)).ravel())


def exact(case: Block, nodes: Ints, forces: Floats) -> Floats:
    f = np.zeros((case.matrix.shape[0], forces.shape[1]))
    f[rows(nodes)] = forces
    return np.asarray(scipy.sparse.linalg.spsolve(case.matrix.tocsc(), f))


def test_it_solves_what_a_general_solver_solves(case: Block) -> None:
    nodes, forces = pushes(case, 9)
    u, true = case.factor.solve(nodes, forces), exact(case, nodes, forces)
    wanted = rows(case.surface)
    assert np.abs(u[wanted] - true[wanted]).max() < 1e-11 * np.abs(true).max()


def test_the_compliance_of_the_surface_is_symmetric(case: Block) -> None:
    nodes, _ = pushes(case, 12)
    C = case.factor.solve(nodes, np.eye(36))[rows(nodes)]
    assert np.abs(C - C.T).max() < 1e-12 * np.abs(C).max()


def test_a_few_rows_are_those_of_the_whole_solve(case: Block) -> None:
    nodes, forces = pushes(case, 3)
    near = case.surface[
        np.linalg.norm(case.points[case.surface] - case.points[nodes[0]], axis=1) < 0.02
    ]
    whole, few = case.factor.solve(nodes, forces), case.factor.solve(nodes, forces, near)
    np.testing.assert_array_equal(few[rows(near)], whole[rows(near)])


def test_single_precision_is_half_the_memory_and_nearly_the_same(case: Block) -> None:
    nodes, forces = pushes(case, 5)
    single, wanted = case.factor.single(), rows(case.surface)
    assert 2 * single.bytes == case.factor.bytes
    u, true = single.solve(nodes, forces)[wanted], case.factor.solve(nodes, forces)[wanted]
    assert u.dtype == np.float32
    assert 0.0 < np.abs(u - true).max() < 1e-5 * np.abs(true).max()


def test_what_is_inside_is_not_kept(case: Block) -> None:
    everything = Factor(case.matrix, case.points, np.ones(len(case.points), dtype=np.bool_))
    assert case.factor.bytes < 0.9 * everything.bytes


def test_an_object_that_can_move_is_refused(case: Block) -> None:
    loose = sp.csr_array(case.matrix - 1e6 * sp.eye_array(case.matrix.shape[0]))
    with pytest.raises(BodyError, match="can move"):
        Factor(loose, case.points, case.wanted)
