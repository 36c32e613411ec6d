"""Unit and axes of a surface that holds an object are found where the user leaves them open."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cohaptic_server.cli.object_options import ObjectOptions
from cohaptic_server.cli.resolved_object import what_is_lacking
from cohaptic_server.mesh.icosphere import icosphere
from cohaptic_server.objects.auto import resolve as module
from cohaptic_server.objects.auto.resolve import find_problems, resolve
from cohaptic_server.objects.fix_surface import UnfitSurfaceError
from cohaptic_server.objects.memory_limit import say_once
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_server.testing.blocks import block
from shapes.phantom import labels, nifti
from tests.server.objects.files import write

meshio: Any = pytest.importorskip("meshio", reason="pip install 'cohaptic[objects]' reads volumes")
PLACE = np.array([30.0, 4.0, -20.0])  # mm; below in the right lobe of the phantom
TURN = np.array([-1.0, -1.0, 1.0])


@pytest.fixture(autouse=True)
def nothing_said() -> None:
    say_once.cache_clear()


@pytest.fixture
def scan(tmp_path: Path) -> Path:
    pytest.importorskip("nibabel", reason="pip install 'cohaptic[scans]' reads scans")
    pytest.importorskip("skimage", reason="pip install 'cohaptic[scans]' contours labels")
    path = tmp_path / "phantom.nii"
    path.write_bytes(nifti(labels()[::3, ::3, ::2], (4.5, 4.5, 6.0)))
    return path


@pytest.fixture
def cube(tmp_path: Path) -> Path:
    mesh = block((0.1, 0.1, 0.1), (4, 4, 4))
    path = tmp_path / "cube.vtk"
    meshio.Mesh(mesh.vertices, [("tetra", mesh.tets)]).write(path)
    return path


def bone(path: Path, radius: float = 18.0, *, space: str = "", lps: bool = True) -> Path:
    """A ball at `PLACE` in millimetres and RAS or LPS, with a header that may say the axes."""
    y, faces = icosphere(2, radius)
    y = y + PLACE
    data = write(path, y * TURN if lps else y, faces).read_bytes()
    header = f"3D Slicer output. SPACE={space}" if space else ""
    path.write_bytes(header.encode().ljust(80, b"\0") + data[80:])
    return path


def of_scan(scan: Path, held: Path, rest: str = "") -> ObjectFile:
    return ObjectFile(scan, labels=("1", "2", "3"), fix_mesh=Path(f"{held}{rest}"))


@pytest.mark.parametrize("ask", [find_problems, resolve], ids=["told", "auto"])
@pytest.mark.parametrize("rest", ["", ":m"])
def test_a_surface_that_may_be_mirrored_is_the_users_choice(
    scan: Path, tmp_path: Path, rest: str, ask: Callable[[ObjectFile], object]
) -> None:
    path = bone(tmp_path / "bone.stl")
    with pytest.raises(UnfitSurfaceError) as caught:
        ask(of_scan(scan, path, rest))
    assert [str(way) for way in caught.value.ways] == [f"{path}:mm:ras", f"{path}:mm:lps"]
    assert f"--fix-mesh {path}:mm:ras or --fix-mesh {path}:mm:lps" in str(caught.value)


@pytest.mark.parametrize(("said", "taken"), [(":lps", ":mm:lps"), (":ras", ":mm:ras")])
def test_a_unit_that_is_left_open_is_chosen(
    scan: Path, tmp_path: Path, said: str, taken: str
) -> None:
    path = bone(tmp_path / "bone.stl")
    found = find_problems(of_scan(scan, path, said))
    (remedy,) = found.remedies
    assert remedy.option == f"--fix-mesh {path}{taken}"
    assert remedy.needed
    assert remedy.problem.startswith("nothing of it lies within bone.stl, which has x ")
    assert remedy.remedy.startswith("taken in millimetres, ")
    assert found.source.fix_mesh == Path(f"{path}{taken}")
    assert find_problems(found.source).remedies == ()
    assert f"With --fix-mesh {path}{taken}: taken in millimetres" in what_is_lacking(found)


def test_what_the_files_say_is_not_replaced(cube: Path, tmp_path: Path) -> None:
    """A cube at one side, whose file says its axes: only turned round the surface would hold it."""
    mesh = block((0.1, 0.1, 0.1), (4, 4, 4))
    x = mesh.vertices + np.array([0.06, 0.06, 0.0])
    meshio.Mesh(x, [("tetra", mesh.tets)]).write(cube, file_format="vtk42", binary=False)
    title, said = b"written by meshio", b"SPACE=LPS"
    start, mark, rest = cube.read_bytes().partition(title)
    assert mark == title
    y, faces = icosphere(2, 0.03)
    path = write(tmp_path / "bone.stl", (y + np.array([0.06, 0.06, 0.05])) * TURN, faces)
    asked = ObjectFile(cube, fix_mesh=path)
    # Where one of the two says nothing, turning is a choice.
    assert find_problems(asked).source.fix_mesh == Path(f"{path}:lps")
    path.write_bytes(said.ljust(80, b"\0") + path.read_bytes()[80:])
    assert find_problems(asked).source.fix_mesh == Path(f"{path}:lps")
    cube.write_bytes(start + said + rest)
    with pytest.raises(UnfitSurfaceError) as caught:
        find_problems(asked)
    assert str(caught.value).endswith(f"; with --fix-mesh {path}:ras some of it would be")


def test_auto_takes_the_one_choice_and_knows_it_the_next_time(
    cube: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    y, faces = icosphere(2, 20.0)
    path = write(tmp_path / "bone.stl", y + 40.0, faces)
    options = ObjectOptions({"fix_mesh": path, "order": 1}, auto=True)
    first = resolve(options.of(cube))
    assert first.source.fix_mesh == Path(f"{path}:mm")
    assert [remedy.option for remedy in first.remedies] == [f"--fix-mesh {path}:mm"]

    def again(*_: object, **__: object) -> None:
        raise AssertionError("the files were looked at again")

    with monkeypatch.context() as patch:
        patch.setattr(module, "find_problems", again)
        assert resolve(options.of(cube)) == first
    write(path, 0.1 * (y + 40.0), faces)
    assert resolve(options.of(cube)).source.fix_mesh == Path(f"{path}:cm")
