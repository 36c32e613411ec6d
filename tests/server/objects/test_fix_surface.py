from __future__ import annotations

import logging
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic.errors import BodyError, SettingError
from cohaptic_server.mesh.icosphere import icosphere
from cohaptic_server.mesh.tetrahedra import TetMesh, boundary
from cohaptic_server.numeric import Floats, Ints, Mask
from cohaptic_server.objects import fix_surface
from cohaptic_server.objects.fix_mesh import AXES, RAS, UNITS
from cohaptic_server.objects.fix_rule import hold
from cohaptic_server.objects.fix_surface import FixSurface, UnfitSurfaceError, inside
from cohaptic_server.objects.memory_limit import say_once
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_server.testing.blocks import block
from tests.examples_of_laws import examples
from tests.server.objects.files import write

_CENTRED = block((0.1, 0.1, 0.1), (5, 5, 5))
# At one side of the z axis, so that a surface which is turned round lies beside it.
BLOCK = TetMesh(_CENTRED.vertices + np.array([0.06, 0.06, 0.0]), _CENTRED.tets)
X, OUTSIDE = BLOCK.vertices, boundary(BLOCK.tets)
MIDDLE = 0.5 * (X.min(axis=0) + X.max(axis=0))
CORNER = X[(X == X.max(axis=0)).all(axis=1)][0]
TURN = np.array([-1.0, -1.0, 1.0])
SCAN, MESH = Path("scan.nii.gz"), Path("block.vtk")  # what their names say is enough here


@pytest.fixture(autouse=True)
def nothing_said() -> None:
    say_once.cache_clear()


@given(st.integers(0, 2**32 - 1), st.booleans())
@settings(max_examples=examples(20), deadline=None)
def test_inside_a_ball_is_what_is_nearer_than_its_radius(seed: int, turned: bool) -> None:
    rng = np.random.default_rng(seed)
    y, faces = icosphere(3, 1.0)
    center = rng.normal(size=3)
    x = center + rng.uniform(-1.5, 1.5, (300, 3))
    r = np.linalg.norm(x - center, axis=1)
    sure = (r < 0.98) | (r > 1.0)  # between them lie the facets
    found = inside(y + center, faces[:, ::-1] if turned else faces, x)
    assert np.array_equal(found[sure], (r < 1.0)[sure])


def test_a_tube_is_not_inside_of_a_ring_that_it_goes_through() -> None:
    ring = trimesh.creation.torus(1.0, 0.3)  # pyright: ignore[reportUnknownMemberType]
    x = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.1], [0.0, 0.5, 0.0]])
    found = inside(np.asarray(ring.vertices), np.asarray(ring.faces, dtype=np.int64), x)
    assert found.tolist() == [False, True, True, False]


def bone(radius: float = 0.03) -> tuple[Floats, Ints]:
    """A ball about a corner of the block; turned round, it lies beside the block [m]."""
    y, faces = icosphere(2, radius)
    return y + CORNER, faces


def source(body: Path, path: Path, rest: str = "", scale: float = 1.0) -> ObjectFile:
    return ObjectFile(body, scale=scale, fix_mesh=Path(f"{path}{rest}"))


def held(wanted: ObjectFile) -> Mask:
    return FixSurface.of(wanted).fixed(X, OUTSIDE)


EXPECTED = inside(*bone(), X)


@given(
    st.sampled_from(list(UNITS)),
    st.sampled_from(AXES),
    st.booleans(),
    st.sampled_from([SCAN, MESH, Path("a.glb")]),
    st.sampled_from(["stl", "ply", "off", "glb"]),
    st.integers(0, 2**32 - 1),
)
@settings(max_examples=examples(30), deadline=None)
def test_a_surface_in_any_unit_and_axes_is_where_it_is_in_metres_and_ras(
    tmp_path_factory: pytest.TempPathFactory,
    unit: str,
    axes: str,
    swapped: bool,
    body: Path,
    kind: str,
    seed: int,
) -> None:
    folder = tmp_path_factory.mktemp("bones")
    y, faces = bone(float(np.random.default_rng(seed).uniform(0.015, 0.09)))
    plain = source(body, write(folder / f"plain.{kind}", y, faces), ":m:ras")
    there = (y if axes == RAS else y * TURN) / UNITS[unit]
    rest = f":{axes.upper()}:{unit}" if swapped else f":{unit}:{axes}"
    other = source(body, write(folder / f"other.{kind}", there, faces), rest)
    assert held(plain).any()
    assert np.array_equal(held(other), held(plain))
    # In single precision a file has 24 bits.
    one, two = (FixSurface.of(each).placed() for each in (plain, other))
    a, b = (sorted(np.round(x + 1.0, 5).tolist()) for x in (one, two))
    assert a == b


def slicer(path: Path, y: Floats, faces: Ints, space: str) -> Path:
    """Write a binary STL whose header says its axes, as 3D Slicer does."""
    data = write(path, y, faces).read_bytes()
    path.write_bytes(f"3D Slicer output. SPACE={space}".encode().ljust(80, b"\0") + data[80:])
    return path


@pytest.mark.parametrize("kind", ["glb", "3mf"])
def test_a_file_that_says_its_unit_has_it_beside_any_object(tmp_path: Path, kind: str) -> None:
    y, faces = bone()
    # trimesh writes numbers of a 3MF as millimetres.
    path = write(tmp_path / f"bone.{kind}", y if kind == "glb" else 1e3 * y, faces)
    for body, scale in ((MESH, 0.001), (MESH, 1.0), (SCAN, 1.0)):
        assert np.array_equal(held(source(body, path, ":ras", scale=scale)), EXPECTED)


def said(caplog: pytest.LogCaptureFixture) -> list[str]:
    return [record.getMessage() for record in caplog.records if record.levelno == logging.WARNING]


@pytest.mark.parametrize("space", ["LPS", "RAS"])
def test_axes_that_a_file_says_are_believed_and_said_once(
    tmp_path: Path, space: str, caplog: pytest.LogCaptureFixture
) -> None:
    """Beside a scan the file is in millimetres, too, as programs write it that write axes."""
    y, faces = bone()
    there = 1e3 * (y * TURN if space == "LPS" else y)
    path = slicer(tmp_path / "bone.stl", there, faces, space)
    for _ in range(2):
        assert np.array_equal(held(source(SCAN, path)), EXPECTED)
    (line,) = said(caplog)
    change = "x and y are turned round to" if space == "LPS" else "these are also"
    assert line.endswith(
        f"bone.stl: it says SPACE={space}: {change} the axes of scan.nii.gz, and it is in"
        " millimetres"
    )


def test_axes_are_not_turned_where_the_object_says_none(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """Two files of one program have the same axes, and one of them may have lost its header."""
    y, faces = bone()
    path = slicer(tmp_path / "bone.stl", 1e3 * y, faces, "LPS")
    assert np.array_equal(held(source(MESH, path, scale=0.001)), EXPECTED)
    assert said(caplog) == [
        f"{path}: it says SPACE=LPS, and block.vtk says no axes: both are taken to have the same;"
        f" --fix-mesh {path}:lps turns x and y round"
    ]
    turned = write(tmp_path / "turned.stl", 1e3 * y * TURN, faces)
    assert np.array_equal(held(source(MESH, turned, ":lps", scale=0.001)), EXPECTED)


def refused(wanted: ObjectFile) -> UnfitSurfaceError:
    with pytest.raises(UnfitSurfaceError) as caught:
        held(wanted)
    return caught.value


def ways(wanted: ObjectFile) -> list[str]:
    return [str(way).removeprefix(f"{way.path}") for way in refused(wanted).ways]


@pytest.mark.parametrize("axes", AXES)
def test_unit_and_axes_of_a_surface_beside_a_scan_are_proposed(tmp_path: Path, axes: str) -> None:
    """The block lies at one side, so that only one choice of axes holds some of it."""
    y, faces = bone()
    path = write(tmp_path / "bone.stl", 1e3 * (y if axes == RAS else y * TURN), faces)
    wanted = source(SCAN, path)
    assert ways(wanted) == [f":mm:{axes}"]
    assert str(refused(wanted)).endswith(f"; with --fix-mesh {path}:mm:{axes} some of it would be")
    assert ways(source(SCAN, path, ":m")) == [f":mm:{axes}"]
    assert ways(source(SCAN, path, ":cm:lps" if axes == RAS else ":cm:ras")) == [f":mm:{axes}"]


def across_the_axis() -> tuple[Floats, Ints]:
    """A ball that reaches the block from where it is, and from where it is turned to [mm]."""
    y, faces = icosphere(2, 50.0)
    return y + np.array([20.0, 20.0, 80.0]), faces


def test_axes_that_nothing_says_and_that_matter_are_told(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path = write(tmp_path / "bone.stl", *across_the_axis())
    plain = held(source(SCAN, path, ":mm"))
    assert np.array_equal(plain, held(source(SCAN, path, ":mm:ras")))
    assert not np.array_equal(plain, held(source(SCAN, path, ":mm:lps")))
    (line,) = said(caplog)
    assert "they are taken as right-anterior-superior (RAS), those of scan.nii.gz" in line
    assert line.endswith(f"would hold another place: --fix-mesh {path}:mm:lps")


@pytest.mark.parametrize("rest", ["", ":mm", ":lps"])
def test_a_surface_that_no_choice_puts_there_has_both_boxes_in_its_error(
    tmp_path: Path, rest: str
) -> None:
    y, faces = icosphere(1, 0.03)
    path = write(tmp_path / "far.stl", y + np.array([1.0, 70.0, -500.0]), faces)
    for body in (SCAN, MESH):
        error = refused(source(body, path, rest))
        assert error.ways == ()
        assert "float away; it has x " in str(error)
        assert ", the object x " in str(error)
        assert "--fix-mesh" not in error.limit


def test_a_surface_within_the_object_is_not_refused_by_the_objects_surface(tmp_path: Path) -> None:
    """No vertex of the outside lies in a bone: those of the tetrahedra are not known yet."""
    y, faces = icosphere(2, 30.0)
    path = write(tmp_path / "bone.stl", y + 1e3 * MIDDLE, faces)
    used, outside = np.unique(OUTSIDE, return_inverse=True)
    surface = FixSurface.of(source(MESH, path, ":mm"))
    assert not surface.fixed(X[used], outside.reshape(-1, 3)).any()
    with pytest.raises(UnfitSurfaceError) as caught:
        FixSurface.of(source(MESH, path)).fixed(X[used], outside.reshape(-1, 3))
    assert [str(way) for way in caught.value.ways] == [f"{path}:mm"]
    assert hold(source(MESH, path, ":mm"), BLOCK).fixed.any()


def test_a_surface_that_cannot_hold_says_why(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    y, faces = icosphere(1, 0.03)
    with pytest.raises(BodyError, match="there is no such file"):
        held(source(MESH, tmp_path / "none.stl"))
    (tmp_path / "slicer.vtk").write_text("# vtk DataFile Version 5.1\n")
    with pytest.raises(BodyError, match=r"slicer\.vtk: .* files of these kinds: \.stl \.obj"):
        held(source(MESH, tmp_path / "slicer.vtk"))
    with pytest.raises(BodyError, match="not closed: 3 of its edges do not have two triangles"):
        held(source(MESH, write(tmp_path / "open.stl", y, faces[1:])))
    with pytest.raises(SettingError, match=r"float away; it has x 0.97 to 1.03 m, .*the object"):
        held(source(MESH, write(tmp_path / "far.stl", y + 1.0, faces)))
    with pytest.raises(SettingError, match="leaves something free to move"):
        held(source(MESH, write(tmp_path / "all.stl", 10.0 * y, faces)))
    monkeypatch.setattr(fix_surface, "MAX_FIX_TRIANGLES", 79)
    with pytest.raises(BodyError, match="80 triangles; to say what is held 79 must do"):
        held(source(MESH, write(tmp_path / "fine.stl", y, faces)))
