from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from cohaptic.errors import BodyError
from cohaptic_server.mesh.icosphere import icosphere
from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_tools.inspection.picture import draw

MESH = SurfaceMesh(*icosphere(2, 0.05))
HEIGHT = MESH.vertices[:, 2]
HELD = HEIGHT < -0.03


def test_a_picture_shows_soft_and_stiff_and_held(tmp_path: Path) -> None:
    matplotlib = pytest.importorskip("matplotlib", reason="pip install 'cohaptic[objects]'")
    stiffness = np.where(HELD, np.inf, 100.0 + 4000.0 * (HEIGHT + 0.03))
    draw(tmp_path / "a.png", MESH, stiffness, HELD, title="ball", notes="held below")
    image = np.asarray(matplotlib.image.imread(tmp_path / "a.png"))[:, :, :3]
    assert image.shape[1] > 1200
    red, green, blue = (image[..., k] for k in range(3))
    wall = image[:, : int(0.85 * image.shape[1])]
    grey = (np.ptp(wall, axis=2) < 0.02) & (wall[..., 0] > 0.3) & (wall[..., 0] < 0.9)
    assert grey.mean() > 0.01
    for shown in ((red > green + 0.02) & (blue > green + 0.05), (green > blue + 0.2)):
        assert shown.mean() > 0.005  # violet is soft, green and yellow are stiff
    assert (image > 0.99).all(axis=2).mean() > 0.3


def test_without_matplotlib_it_is_said_how_to_get_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(BodyError, match=r"needs matplotlib; install it with: pip install"):
        draw(tmp_path / "a.png", MESH, 1.0 + HEIGHT, HELD, title="", notes="")


def test_a_picture_that_cannot_be_written_says_so(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib", reason="pip install 'cohaptic[objects]'")
    with pytest.raises(BodyError, match="the picture cannot be written"):
        draw(tmp_path / "no" / "a.png", MESH, 1.0 + HEIGHT, HELD, title="", notes="")


def test_nothing_of_a_tall_object_is_cut_off(tmp_path: Path) -> None:
    matplotlib = pytest.importorskip("matplotlib", reason="pip install 'cohaptic[objects]'")
    x = MESH.vertices * np.array([0.2, 0.2, 2.0])
    draw(tmp_path / "a.png", SurfaceMesh(x, MESH.faces), 1.0 + HEIGHT, HELD, title="", notes="")
    image = np.asarray(matplotlib.image.imread(tmp_path / "a.png"))[:, :, :3]
    height, width = image.shape[:2]
    # Along the upper and lower ends of the two views in the first row; their names are at the left.
    for end in (0.465, 0.875):
        rows = image[round((1.0 - end) * height) - 3 : round((1.0 - end) * height) + 3]
        for left in (0.01, 0.44):
            part = rows[:, round((left + 0.1) * width) : round((left + 0.42) * width)]
            assert (part > 0.99).all()
