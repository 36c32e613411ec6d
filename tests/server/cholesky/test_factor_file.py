from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cohaptic.errors import BodyError
from cohaptic_server.cholesky.factor_file import from_arrays, to_arrays
from cohaptic_server.cholesky.factorise import factorise
from cohaptic_server.objects.store.array_file import load_arrays, save_arrays
from tests.server.cholesky.block_problem import in_single, on_surface, problem


def test_the_stored_factor_solves_to_the_same_bits(tmp_path: Path) -> None:
    matrix, points = problem()
    retained = on_surface(points)
    made = factorise(matrix, points, retained)
    save_arrays(tmp_path / "factor", to_arrays(made))
    read = from_arrays(load_arrays(tmp_path / "factor"))
    assert (read.size, read.bytes) == (made.size, made.bytes)
    nodes = np.flatnonzero(retained)[::7]
    forces = np.random.default_rng(1).normal(size=(3 * len(nodes), 3))
    assert np.array_equal(read.solve(nodes, forces), made.solve(nodes, forces))
    narrow = in_single(read).solve(nodes, forces, nodes[:2])
    assert np.array_equal(narrow, in_single(made).solve(nodes, forces, nodes[:2]))


@pytest.mark.parametrize("damage", ["lower", "carry", "parent", "own", "front_of", "gone"])
def test_arrays_that_do_not_fit_together_are_no_factor(damage: str) -> None:
    matrix, points = problem()
    arrays = to_arrays(factorise(matrix, points, on_surface(points)))
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
        from_arrays(arrays)
