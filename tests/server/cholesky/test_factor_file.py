from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp

from cohaptic.errors import BodyError
from cohaptic_server.cholesky.factor_file import from_arrays, indices_of, stored_bytes, to_arrays
from cohaptic_server.cholesky.factorise import factorise, mutual_compliance, self_compliance
from cohaptic_server.objects.store.cache import load_arrays, save_arrays
from tests.server.cholesky.block_problem import in_single, on_surface, problem


def test_the_stored_factor_solves_as_the_one_in_single_precision(tmp_path: Path) -> None:
    matrix, points = problem()
    retained = on_surface(points)
    made = factorise(matrix, points, retained)
    save_arrays(tmp_path / "factor", to_arrays(made))
    read = from_arrays(load_arrays(tmp_path / "factor"))
    assert (read.size, read.bytes) == (made.size, made.bytes // 2)
    assert stored_bytes(indices_of(made)["fronts"]) == read.bytes
    nodes = np.flatnonzero(retained)[::7]
    forces = np.random.default_rng(1).normal(size=(3 * len(nodes), 3))
    assert np.array_equal(read.solve(nodes, forces), in_single(made).solve(nodes, forces))
    for ours, theirs in zip(made.fronts, read.fronts, strict=True):
        # LAPACK copies a block that lies the other way round at every solve.
        assert theirs.lower.flags.f_contiguous
        assert theirs.carry.flags.c_contiguous
        assert np.array_equal(theirs.lower, ours.lower.astype(np.float32))


def test_a_multiple_of_a_matrix_has_a_part_of_the_displacement_also_after_storing() -> None:
    matrix, points = problem()
    retained = on_surface(points)
    made = factorise(matrix, points, retained)
    nodes = np.flatnonzero(retained)[::9]
    forces = np.random.default_rng(1).normal(size=(3 * len(nodes), 2))
    whole = made.solve(nodes, forces)
    for factor in (made.times(4.0), from_arrays(to_arrays(made.times(4.0), np.float64))):
        assert np.array_equal(factor.solve(nodes, forces), 0.25 * whole)
        presses = sp.csr_array(np.eye(len(points))[:, nodes])
        for of in (self_compliance, mutual_compliance):
            assert np.array_equal(of(factor, presses), 0.25 * of(made, presses))
    without = {k: v for k, v in to_arrays(made, np.float64).items() if k != "multiple"}
    with pytest.raises(BodyError, match="multiple"):
        from_arrays(without)


@pytest.mark.parametrize("damage", ["values", "border", "parent", "own", "front_of", "gone"])
def test_arrays_that_do_not_fit_together_are_no_factor(damage: str) -> None:
    matrix, points = problem()
    arrays = to_arrays(factorise(matrix, points, on_surface(points)))
    if damage == "values":
        arrays["values"] = arrays["values"][:-1]
    elif damage == "parent":
        arrays["fronts"] = arrays["fronts"].copy()
        arrays["fronts"][1, 2] = 0
    elif damage == "gone":
        del arrays["own"]
    elif damage == "border":
        arrays["border"] = arrays["border"][:-1]
    else:
        arrays[damage] = arrays[damage] + 10 * len(points)
    with pytest.raises(BodyError, match="this is no factor"):
        from_arrays(arrays)
