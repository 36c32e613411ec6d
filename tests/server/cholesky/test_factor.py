from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp
import scipy.sparse.linalg

from cohaptic.errors import BodyError
from cohaptic_server.bodies.solid.parts import stiffness_of
from cohaptic_server.bodies.solid.shape import SolidSettings, shape_of
from cohaptic_server.cholesky.factor import Factor
from cohaptic_server.numeric import Floats
from cohaptic_server.objects.store.array_file import load_arrays, save_arrays
from cohaptic_server.testing.blocks import block

Problem = tuple[sp.csr_array, Floats]


@pytest.fixture(scope="module")
def problem() -> Problem:
    """Stiffness and places of the free nodes of a block of several fronts."""
    mesh, settings = block((0.1, 0.1, 0.1), (7, 7, 7)), SolidSettings(order=1)
    shape = shape_of(mesh, mesh.vertices[:, 2] <= 0.0, settings)
    free = np.flatnonzero(~shape.held)
    dof = (3 * free[:, None] + np.arange(3)).ravel()
    return sp.csr_array(stiffness_of(shape, settings)[dof][:, dof]), shape.nodes[free]


def outside(points: Floats) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    return np.asarray((np.abs(points[:, :2]).max(axis=1) > 0.049) | (points[:, 2] > 0.099))


def test_it_solves_what_a_general_solver_solves(problem: Problem) -> None:
    matrix, points = problem
    forces = np.random.default_rng(0).normal(size=(matrix.shape[0], 2))
    whole = Factor(matrix, points, np.ones(len(points), dtype=np.bool_))
    x = whole.solve(np.arange(len(points)), forces)
    exact = scipy.sparse.linalg.spsolve(matrix.tocsc(), forces)
    assert np.abs(x - exact).max() < 1e-10 * np.abs(exact).max()


def test_the_stored_factor_solves_to_the_same_bits(problem: Problem, tmp_path: Path) -> None:
    matrix, points = problem
    wanted = outside(points)
    made = Factor(matrix, points, wanted)
    save_arrays(tmp_path / "factor", made.to_arrays())
    read = Factor.from_arrays(load_arrays(tmp_path / "factor"))
    assert (read.size, read.bytes) == (made.size, made.bytes)
    nodes = np.flatnonzero(wanted)[::7]
    forces = np.random.default_rng(1).normal(size=(3 * len(nodes), 3))
    assert np.array_equal(read.solve(nodes, forces), made.solve(nodes, forces))
    narrow = read.single().solve(nodes, forces, nodes[:2])
    assert np.array_equal(narrow, made.single().solve(nodes, forces, nodes[:2]))


@pytest.mark.parametrize("damage", ["lower", "carry", "parent", "own", "front_of", "gone"])
def test_arrays_that_do_not_fit_together_are_no_factor(problem: Problem, damage: str) -> None:
    matrix, points = problem
    arrays = Factor(matrix, points, outside(points)).to_arrays()
    last = max(int(name[5:]) for name in arrays if name.startswith("lower"))
    if damage in ("lower", "carry"):
        arrays[f"{damage}{last}"] = arrays[f"{damage}{last}"][:-1, :-1]
    elif damage == "parent":
        arrays["fronts"] = arrays["fronts"].copy()
        arrays["fronts"][1, 2] = 0
    elif damage == "gone":
        del arrays["own"]
    else:
        arrays[damage] = arrays[damage] + 10 * len(points)
    if damage == "carry":  # the root has none
        arrays["fronts"] = arrays["fronts"].copy()
        arrays["fronts"][last, 1] += 1
    with pytest.raises(BodyError, match="this is no factor"):
        Factor.from_arrays(arrays)


def test_progress_rises_to_the_whole(problem: Problem) -> None:
    matrix, points = problem
    told: list[float] = []
    Factor(matrix, points, outside(points), told.append)
    assert told == sorted(told)
    assert (told[0] < 0.1, told[-1]) == (True, 1.0)
