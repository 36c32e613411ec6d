from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from cohaptic.errors import CohapticError
from cohaptic_server.mesh.icosphere import icosphere
from cohaptic_server.testing.blocks import block
from cohaptic_tools.body_cli import body
from cohaptic_tools.inspection import object_files
from tests.server.objects.files import write

meshio: Any = pytest.importorskip("meshio", reason="pip install 'cohaptic[objects]' reads volumes")
HOLD = ["--fix", "z <= 0%", "--order", "1"]
Run = Callable[..., str]


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Run:
    monkeypatch.setenv("COHAPTIC_CACHE", str(tmp_path / "store"))
    monkeypatch.setenv("COLUMNS", "200")

    def call(*arguments: str) -> str:
        result = CliRunner().invoke(body, list(arguments))
        if isinstance(result.exception, CohapticError):
            raise result.exception
        assert result.exit_code == 0, result.output
        return result.output

    return call


@pytest.fixture
def cube(tmp_path: Path) -> str:
    mesh = block((0.1, 0.1, 0.1), (5, 5, 5))
    path = tmp_path / "cube.vtk"
    meshio.Mesh(mesh.vertices, [("tetra", mesh.tets)]).write(path)
    return str(path)


def test_prepare_says_what_it_has_made_and_where(run: Run, cube: str, tmp_path: Path) -> None:
    reported = run("prepare", cube, *HOLD)
    assert "cube.vtk: 750 tetrahedra, 152 vertices of surface" in reported
    assert f"ready in {tmp_path / 'store'} after" in reported
    stored = {path: path.stat().st_mtime_ns for path in (tmp_path / "store").iterdir()}
    assert len(stored) == 2  # tetrahedra, and what makes a solid of them
    run("prepare", cube, *HOLD)
    assert {path for path in (tmp_path / "store").iterdir()} == set(stored)
    run("prepare", cube, *HOLD, "--young", "1000")
    assert {path for path in (tmp_path / "store").iterdir()} == set(stored)  # a multiple of it
    run("prepare", cube, *HOLD, "--poisson", "0.3")
    assert len(list((tmp_path / "store").iterdir())) == 3


def test_inspect_says_what_a_cube_is_like(run: Run, cube: str, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib", reason="pip install 'cohaptic[objects]'")
    picture = tmp_path / "cube.png"
    reported = run("inspect", cube, *HOLD, "--density", "1200", "--out", str(picture))
    for words in (
        "a volume mesh, taken as it is",
        "100 x 100 x 100 mm",
        "750 tetrahedra of order 1, 216 nodes, 152 on the surface",
        "angles between faces 45.0 to 90.0 degrees",
        "36 nodes, 24% of the vertices of the surface",
        "1000 cm3, 1.2 kg",
        "the lowest natural one is",
        "in the median, under a contact of",
        "for 8",
        f"written to {picture}",
    ):
        assert words in reported
    assert picture.stat().st_size > 20_000


def test_a_surface_that_holds_is_read_in_its_unit_and_drawn(
    run: Run, cube: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("matplotlib", reason="pip install 'cohaptic[objects]'")
    y, faces = icosphere(2, 50.0)
    bone = write(tmp_path / "bone.stl", y, faces)  # about the middle of the lower side [mm]
    seen: dict[str, Any] = {}

    def look(*_: object, **more: Any) -> None:
        seen.update(more)

    monkeypatch.setattr(object_files, "draw", look)
    picture = ["--order", "1", "--out", str(tmp_path / "cube.png")]
    with pytest.raises(
        CohapticError, match=r"With --fix-mesh .*bone\.stl:mm: taken in millimetres"
    ):
        run("inspect", cube, "--fix-mesh", str(bone), *picture)
    reported = run("inspect", cube, "--fix-mesh", f"{bone}:mm", *picture)
    assert "% of the vertices of the surface" in reported
    x, triangles = seen["holding"]
    # In the frame of the object, whose origin is 50 mm above the lower side.
    assert np.ptp(x, axis=0) == pytest.approx(0.1, rel=0.01)
    assert x.max(axis=0) == pytest.approx([0.05, 0.05, 0.0], abs=0.001)
    assert len(triangles) == len(faces)
    assert seen["axes_of_file"] == ""
    assert seen["notes"].endswith("bone.stl:mm")


@pytest.mark.parametrize(
    ("option", "words"),
    [
        (["--density", "0"], "--density is 0 kg/m3; it must be from 1 to 30000"),
        (["--users", "40"], "--users is 40; it must be at most 17 at 60 Hz"),
        (["--users", "2", "--hz", "300"], "--hz is 300 Hz; it must be from 10 to 200"),
        (["--out", "cube.jpg"], "--out is cube.jpg; it must be a file that ends with .png"),
        (["--out", "no/such/cube.png"], "in a folder that exists: not no/such"),
    ],
)
def test_what_cannot_be_inspected_says_why(
    run: Run, cube: str, option: list[str], words: str
) -> None:
    with pytest.raises(CohapticError) as error:
        run("inspect", cube, *HOLD, *option)
    assert words in str(error.value)
