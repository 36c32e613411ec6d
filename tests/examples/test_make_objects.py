"""The files of `examples/` are what its generator makes, and objects that can be touched."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.objects.surface.checks import examine
from cohaptic_server.objects.surface.surface_file import read_surface
from shapes.lobes import organ
from shapes.solids import torus

EXAMPLES = Path(__file__).parents[2] / "examples"
SMALL = 300_000  # bytes


@pytest.fixture(scope="module", params=["torus.stl", "organ.ply"])
def file(request: pytest.FixtureRequest) -> Path:
    return EXAMPLES / str(request.param)


def sorted_corners(x: Floats, faces: Ints) -> Floats:
    """Corners of all triangles in an order of their own: files and tools keep no other."""
    corners = x[faces].reshape(-1, 3).round(6)
    return corners[np.lexsort(corners.T)]


def test_the_file_is_what_the_generator_makes(file: Path) -> None:
    x, faces = torus() if file.stem == "torus" else organ()
    stored = sorted_corners(*read_surface(file))
    assert stored == pytest.approx(sorted_corners(x, faces), abs=3e-6)  # 24 bits, and rounding
    assert file.stat().st_size <= SMALL


def test_it_is_an_object_that_stands_on_a_table(file: Path) -> None:
    x, faces = read_surface(file)
    report = examine(x, faces)
    assert (report.problems(), report.components) == ([], 1)
    assert report.volume > 0.0
    assert x[:, 2].min() == pytest.approx(0.0, abs=1e-6)
    assert 0.15 < np.ptp(x, axis=0).max() < 0.25
