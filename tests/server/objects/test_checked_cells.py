"""Behind the gate every corner is there, finite, used, and apart from the others."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.errors import BodyError
from cohaptic_server.mesh.icosphere import icosphere
from cohaptic_server.mesh.tetrahedra import volumes
from cohaptic_server.objects.checked_cells import LARGEST, SMALLEST, checked_cells

FILE = Path("a.obj")
X = np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)])
FACES = np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)])
TETS = np.array([(0, 1, 2, 3)])
NAN, INF = float("nan"), float("inf")


@pytest.mark.parametrize("cells", [FACES, TETS], ids=["triangles", "tetrahedra"])
@pytest.mark.parametrize("far", [1e30, NAN, INF], ids=str)
def test_a_point_that_no_cell_uses_decides_nothing(cells: np.ndarray, far: float) -> None:
    x = np.concatenate([[(far, 0.0, 0.0)], X, [(0.0, far, 0.0)]])
    found, renumbered = checked_cells(FILE, x, cells + 1)
    assert (found == X).all()
    assert (renumbered == cells).all()


def changed(vertex: int, to: tuple[float, float, float]) -> np.ndarray:
    x = X.copy()
    x[vertex] = to
    return x


@pytest.mark.parametrize(
    ("x", "cells", "words"),
    [
        (X, FACES + 1, "a triangle names vertex 4 of 4"),
        (X, FACES - 1, "a triangle names vertex -1 of 4"),
        (X, TETS + 1, "a tetrahedron names vertex 4 of 4"),
        (changed(3, (NAN, 0, 0)), FACES, "1 of 4 vertices have a coordinate that is not a number"),
        (changed(3, (-INF, 0, 0)), TETS, "1 of 4 vertices have a coordinate that is not a number"),
        (changed(3, (0, 0, 1.7e308)), FACES, r"longest side is 1\.7e\+308 units long"),
        (np.array([-1e308, 1e308])[:, None] * X[[1, 1]], np.array([(0, 1, 0)]), "is inf units"),
        (2.0 * LARGEST * X, FACES, "its longest side is .* units long; .* by --scale"),
        (0.5 * SMALLEST * X, TETS, "its longest side is .* units long; .* by --scale"),
        (X + 1e12, FACES, r"lies 1e\+12 units from the origin .* Move it to the origin"),
        (0.0 * X, FACES, "all its 4 vertices lie at one place"),
        (X * [1.0, 0.0, 0.0], FACES, "each of its 4 triangles has two corners .* all on one line"),
        (X * [1.0, 1e-10, 1e-10], FACES, "there is no surface in it"),
        (X * [1.0, 1.0, 0.0], TETS, "1 of 1 tetrahedra are flat. Mesh the object anew"),
        (X, np.array([(0, 1, 2, 3), (0, 1, 2, 2)]), "1 of 2 tetrahedra are flat"),
    ],
)
def test_what_is_no_object_is_one_sentence(x: np.ndarray, cells: np.ndarray, words: str) -> None:
    with pytest.raises(BodyError, match=words) as error:
        checked_cells(FILE, x, cells)
    assert str(error.value).startswith("a.obj: ")
    assert "\n" not in str(error.value)


def test_a_triangle_without_area_among_others_stays() -> None:
    """Programs close seams by such triangles; without them the surface would be open."""
    x, faces = icosphere(1, 1.0)
    middle = 0.5 * (x[faces[0, 0]] + x[faces[0, 1]])
    needle = np.array([[faces[0, 0], faces[0, 1], len(x)]])
    _, found = checked_cells(FILE, np.vstack([x, middle]), np.concatenate([faces, needle]))
    assert len(found) == len(faces) + 1


@given(
    st.lists(st.tuples(*[st.floats(-9.0, 9.0) | st.integers(0, 1)] * 3), min_size=6),
    st.integers(0, 2**32 - 1),
)
def test_tetrahedra_that_pass_have_a_volume(
    points: list[tuple[float, float, float]], seed: int
) -> None:
    x = np.array(points, dtype=np.float64)
    tets = np.random.default_rng(seed).integers(0, len(x), size=(2, 4))
    try:
        found, cells = checked_cells(FILE, x, tets)
    except BodyError:
        return
    assert np.isfinite(found).all()
    assert (np.unique(cells) == np.arange(len(found))).all()
    assert (volumes(found, cells) != 0.0).all()
