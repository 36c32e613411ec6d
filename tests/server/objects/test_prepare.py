from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from scipy.spatial import KDTree

from cohaptic.errors import BodyError
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.mesh.icosphere import icosphere
from cohaptic_server.mesh.tetrahedra import boundary
from cohaptic_server.mesh.tetrahedra import quadratic as with_middles
from cohaptic_server.objects import cost
from cohaptic_server.objects.auto.resolve import find_problems
from cohaptic_server.objects.build import build_solid
from cohaptic_server.objects.catalogue import build_body
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_server.objects.prepare import prepare
from cohaptic_server.objects.surface import accept, checks
from cohaptic_server.objects.surface.checks import examine
from cohaptic_server.objects.surface.surface_file import read_surface
from cohaptic_server.testing.blocks import block
from tests.server.objects.files import write

pytest.importorskip("pytetwild", reason="pip install 'cohaptic[objects]' fills surfaces")
meshio: Any = pytest.importorskip("meshio", reason="pip install 'cohaptic[objects]' reads volumes")


def sphere(path: Path, radius: float = 0.05) -> Path:
    return write(path, *icosphere(2, radius))


@pytest.mark.live
@pytest.mark.parametrize("kind", ["stl", "obj", "ply", "glb", "off"])
def test_a_surface_of_every_kind_becomes_a_solid(kind: str, tmp_path: Path) -> None:
    path = sphere(tmp_path / f"ball.{kind}")
    body = build_body(str(path), ObjectFile(path, "z < 20%", edge=0.15))
    assert isinstance(body, Solid)
    assert body.name == "ball"
    assert body.shape.tets.volume == pytest.approx(4 / 3 * np.pi * 0.05**3, rel=0.08)
    assert np.abs(body.mesh.vertices).max() == pytest.approx(0.05, rel=0.02)
    assert body.shape.fixed[body.shape.surface].any()


@pytest.mark.parametrize("kind", ["msh", "vtk", "vtu"])
@pytest.mark.parametrize("quadratic", [False, True])
def test_a_volume_of_every_kind_becomes_a_solid(kind: str, quadratic: bool, tmp_path: Path) -> None:
    mesh = block((0.1, 0.1, 0.1), (2, 2, 2))
    cells, x = mesh.tets, mesh.vertices
    if quadratic:
        x, cells = with_middles(mesh)
    path = tmp_path / f"block.{kind}"
    name = "tetra10" if quadratic else "tetra"
    form = {"file_format": "gmsh"} if kind == "msh" else {}
    meshio.Mesh(x, [(name, cells)]).write(path, **form)
    body = build_solid(ObjectFile(path, "z <= 0%", material=SolidSettings(order=1)))
    assert body.shape.tets.volume == pytest.approx(1e-3)
    assert len(body.shape.tets.tets) == len(mesh.tets)


def broken(defect: str, folder: Path) -> Path:
    """A file with one thing wrong."""
    x, faces = icosphere(2, 0.05)
    path = folder / f"{defect}.stl"
    if defect == "empty":
        path.write_bytes(b"")
        return path
    if defect == "poem":
        path = folder / "poem.ply"
        path.write_text("Shall I compare thee to a summer's day?\n")
        return path
    if defect == "noise":
        path = folder / "noise.glb"
        path.write_bytes(np.random.default_rng(0).bytes(2000))
        return path
    if defect == "points":
        path = folder / "points.obj"
        path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\n")
        return path
    if defect == "nan":
        path = folder / "nan.obj"
        path.write_text(
            "v 0 0 0\nv nan 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"
        )
        return path
    if defect == "open":
        faces = faces[:-3]
    if defect in ("tangled", "mirrored"):
        y = x + np.array([0.033, 0.01 if defect == "tangled" else 0.0, 0.0])
        x, faces = np.concatenate([x, y]), np.concatenate([faces, faces + len(x)])
    if defect == "pieces":
        x, faces = np.concatenate([x, x + 0.2]), np.concatenate([faces, faces + len(x)])
    if defect == "flat":
        x = x * np.array([1.0, 1.0, 0.0]) + 1e-9 * x
    return write(path, x, faces)


@pytest.mark.parametrize(
    ("defect", "sentence"),
    [
        ("empty", "the file is empty"),
        ("poem", "this is no mesh that can be read"),
        ("noise", "this is no mesh that can be read"),
        ("points", "no mesh that can be read|there is no triangle in it"),
        ("nan", "1 of 4 vertices have a coordinate that is not a number"),
        ("open", "the surface is open: 5 edges have one triangle only.*--repair"),
        ("mirrored", r"passes through itself: \d+ triangles cross"),
        ("tangled", r"passes through itself: \d+ triangles cross.*--repair"),
        ("pieces", "the surface is in 2 pieces; it must be one"),
        ("flat", "encloses no volume"),
    ],
)
def test_a_broken_file_is_one_sentence(defect: str, sentence: str, tmp_path: Path) -> None:
    path = broken(defect, tmp_path)
    with pytest.raises(BodyError, match=sentence) as error:
        build_solid(ObjectFile(path, "z < 20%", edge=0.2))
    assert str(error.value).startswith(f"{path}: ")
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("read", [find_problems, prepare])
def test_triangles_too_many_to_compare_are_one_sentence(
    read: Callable[[ObjectFile], object], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(checks, "_MAX_PAIRS", 10)
    path = write(tmp_path / "ball.stl", *icosphere(2, 0.05))
    with pytest.raises(BodyError, match="more than 10 pairs of its triangles lie close") as error:
        read(ObjectFile(path, "z < 20%"))
    assert str(error.value).startswith(f"{path}: ")


@pytest.mark.parametrize("sections", [12, 24, 48])
def test_a_torus_in_single_precision_does_not_cross_itself(sections: int, tmp_path: Path) -> None:
    """Triangles beside each other in one plane, and a seam where corners agree to 24 bits."""
    path = tmp_path / "torus.stl"
    trimesh.creation.torus(  # pyright: ignore[reportUnknownMemberType]
        0.06, 0.025, major_sections=2 * sections, minor_sections=sections
    ).export(path)
    report = examine(*read_surface(path))
    assert report.problems() == []
    assert report.volume == pytest.approx(2.0 * np.pi**2 * 0.06 * 0.025**2, rel=0.06)


@pytest.mark.parametrize("kind", ["msh", "vtk", "vtu"])
def test_a_volume_file_that_is_none_is_one_sentence(
    kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / f"poem.{kind}"
    path.write_text("Shall I compare thee to a summer's day?\n")
    with pytest.raises(BodyError, match="no mesh that can be read"):
        build_solid(ObjectFile(path, "z < 20%"))
    assert capsys.readouterr().out == ""


def test_millions_of_triangles_are_refused_with_the_number(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(accept, "MAX_TRIANGLES", 300)
    with pytest.raises(BodyError, match="320 triangles; the limit is 300"):
        build_solid(ObjectFile(sphere(tmp_path / "ball.stl"), "z < 20%"))


@pytest.mark.live
def test_a_solid_too_large_for_memory_is_refused_with_the_estimate(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cost, "_PROGRAM", 0.6e9)
    path = sphere(tmp_path / "ball.stl")
    said = r"tetrahedra of order 2 would take 0\.7.* GB to prepare; the limit is 0\.5 GB\. Take"
    with pytest.raises(
        BodyError, match=said + r" --edge 0\.\d+ or --order 1 or --max-memory 0\.\d"
    ):
        build_solid(ObjectFile(path, "z < 20%", edge=0.2, max_memory=0.5e9))


@pytest.mark.live
def test_the_distance_from_the_file_is_measured(tmp_path: Path) -> None:
    """Beside the distance from a dense cloud of points on the tetrahedra's surface."""
    path = sphere(tmp_path / "ball.stl")
    x, _ = read_surface(path)
    fraction = np.linspace(0.0, 1.0, 15)
    lattice = np.array(
        [(a, b, 1.0 - a - b) for a in fraction for b in fraction if a + b <= 1.0 + 1e-9]
    )
    found: list[float] = []
    for edge in (0.1, 0.4):
        made = prepare(ObjectFile(path, edge=edge))
        cloud = lattice @ made.tets.vertices[boundary(made.tets.tets)]
        distance, _ = KDTree(cloud.reshape(-1, 3)).query(x)
        assert made.deviation == pytest.approx(float(np.max(distance)), abs=5e-4)
        found.append(made.deviation)
    assert found[1] > 1e-3 > found[0]
