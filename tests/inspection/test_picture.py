from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from cohaptic_server.mesh.icosphere import icosphere
from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.numeric import Floats, Ints
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


def drawn(path: Path, **more: Any) -> npt.NDArray[Any]:
    """The picture of the ball, as shares of red, green and blue."""
    matplotlib = pytest.importorskip("matplotlib", reason="pip install 'cohaptic[objects]'")
    draw(path, MESH, 100.0 + 4000.0 * (HEIGHT + 0.06), HELD, title="ball", notes="", **more)
    return np.asarray(matplotlib.image.imread(path))[:, :, :3]


def orange(image: npt.NDArray[Any]) -> Floats:
    """Pixels of the outline in the view from above, as shares of its width and height, (n, 2)."""
    height, width = image.shape[:2]
    left, right = (round(fraction * width) for fraction in (0.01, 0.43))
    top, bottom = (round(fraction * height) for fraction in (0.54, 0.95))
    view = image[top:bottom, left:right]
    seen = np.argwhere((view[..., 0] > 0.7) & (view[..., 1] < 0.5) & (view[..., 2] < 0.25))
    return np.asarray(seen[:, ::-1] / np.array([right - left, bottom - top]))


def moved(x: float, y: float, radius: float = 0.01) -> tuple[Floats, Ints]:
    surface, faces = icosphere(2, radius)
    return surface + np.array([x, y, 0.0]), faces


@pytest.mark.parametrize(("x", "y"), [(0.02, 0.02), (-0.02, -0.02), (0.02, -0.02)])
def test_the_surface_that_holds_is_outlined_where_it_lies(
    tmp_path: Path, x: float, y: float
) -> None:
    """A surface in the mirrored place is seen there: from above x is to the right, and y is up."""
    seen = orange(drawn(tmp_path / "a.png", holding=moved(x, y)))
    assert len(seen) > 100
    across, down = seen.mean(axis=0)
    assert (across > 0.5) == (x > 0.0)
    assert (down < 0.5) == (y > 0.0)
    # The outline of a ball is a circle as large as the ball.
    assert np.ptp(seen[:, 0]) == pytest.approx(0.2 / 1.03 * 0.72, rel=0.1)


def texts(monkeypatch: pytest.MonkeyPatch, folder: Path, axes: str) -> list[dict[str, Any]]:
    """The texts in each view, with their places in it."""
    figure = pytest.importorskip("matplotlib.figure", reason="pip install 'cohaptic[objects]'")
    kept: list[Any] = []

    def keep(self: object, *_: object, **__: object) -> None:
        kept.append(self)

    monkeypatch.setattr(figure.Figure, "savefig", keep)
    stiffness = 100.0 + 4000.0 * (HEIGHT + 0.06)
    draw(folder / "a.png", MESH, stiffness, HELD, title="", notes="", axes_of_file=axes)
    return [{text.get_text(): text for text in view.texts} for view in kept[0].axes[:4]]


@pytest.mark.parametrize("axes", ["ras", "lps"])
def test_letters_stand_at_the_ends_of_the_axes_of_a_patient(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, axes: str
) -> None:
    found = texts(monkeypatch, tmp_path, axes)
    right, forwards = (1.0, 1.0) if axes == "ras" else (-1.0, -1.0)
    for name, view in zip(("front", "back", "above", "below"), found, strict=True):
        place = {letter: np.array(text.get_position()) for letter, text in view.items()}
        towards = {"front": right, "back": -right, "above": right, "below": right}[name]
        assert np.sign(place["R"] - place["L"])[0] == towards
        assert {"A", "P"} <= set(place)
        if name in ("front", "back"):
            assert place["S"][1] > place["I"][1]
            assert ("from the front" in view) == ((name == "front") == (axes == "lps"))
        else:
            ahead = forwards if name == "above" else -forwards
            assert np.sign(place["A"] - place["P"])[1] == ahead
            assert "S" not in place  # it points at the eye
