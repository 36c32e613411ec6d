"""One surface from the triangles of a file, however often it has them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic_server.mesh.icosphere import icosphere
from cohaptic_server.objects.surface.checks import examine
from cohaptic_server.objects.surface.surface_file import checked

FILE = Path("a.obj")
X, FACES = icosphere(1, 0.05)


@given(st.lists(st.tuples(st.integers(0, len(FACES) - 1), st.integers(0, 2)), max_size=200))
def test_a_triangle_counts_once_however_often_it_is_there(more: list[tuple[int, int]]) -> None:
    again = [np.roll(FACES[face], turn) for face, turn in more]
    x, faces = checked(FILE, X, np.vstack([FACES, *again]))
    assert len(faces) == len(FACES)
    assert (x[faces] == X[FACES]).all()
    assert not examine(x, faces).problems()


def test_points_without_a_triangle_are_left_out() -> None:
    x, faces = checked(FILE, np.vstack([[[9.0, 9.0, 9.0]], X]), FACES + 1)
    assert len(x) == len(X)
    assert np.ptp(x, axis=0).max() == pytest.approx(0.1)
    assert (x[faces] == X[FACES]).all()
