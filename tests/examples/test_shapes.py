"""The many shapes are what their names say, and the same each time."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

import make_objects
from cohaptic_server.mesh.enclosed_volume import volume
from cohaptic_server.numeric import Floats
from cohaptic_server.objects.surface.checks import SurfaceReport, edge_counts, examine
from cohaptic_server.objects.surface.surface_file import read_surface
from cohaptic_server.objects.volume_file import read_volume
from cohaptic_server.touchable import SURFACES, VOLUMES
from shapes.catalogue import MANY
from shapes.implicit import Limb, blended, surface

pytestmark = pytest.mark.slow

# What is wrong with a surface: open, with branching edges, crossing itself, in so many pieces.
FLAWED = {
    "bowl.stl": (True, False, False, 1),
    "crossing.stl": (False, False, True, 2),
    "nested.stl": (False, False, False, 2),
    "open_ball.stl": (True, False, False, 1),
    "parts.glb": (False, False, False, 2),
    "pile.stl": (False, False, True, 20),
    "pinched.stl": (False, False, True, 1),
    "scattered.stl": (False, False, False, 20),
    "sheet.ply": (True, False, False, 1),
    "touching.stl": (False, True, False, 1),
}
UNREAD = {"strips.ply"}  # triangle strips, which the reader refuses
SOUND = sorted(
    name for name in MANY.keys() - FLAWED.keys() - UNREAD if Path(name).suffix in SURFACES
)
FINE = 10_000  # triangles; to look for those that cross takes seconds
SEEDED = ("flipped.ply", "millimetres.3mf", "noisy_ball.ply", "pile.stl", "scan.stl")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """All of them, as the command writes them."""
    folder = tmp_path_factory.mktemp("many")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["make_objects.py", "--many", str(folder)])
        make_objects.main()
    return folder


def report(path: Path) -> SurfaceReport:
    return examine(*read_surface(path))


def extent(path: Path) -> Floats:
    return np.asarray(np.ptp(read_surface(path)[0], axis=0))


def test_there_are_many(folder: Path) -> None:
    assert {path.name for path in folder.iterdir()} == MANY.keys()
    assert len(MANY) >= 28
    assert {Path(name).suffix for name in MANY} >= {".stl", ".ply", ".obj", ".glb", ".3mf", ".msh"}


@pytest.mark.parametrize("name", SEEDED)
def test_the_bytes_are_the_same_each_time(name: str, folder: Path) -> None:
    assert MANY[name]() == (folder / name).read_bytes()


@pytest.mark.parametrize("name", SOUND)
def test_a_sound_surface_has_no_flaw(name: str, folder: Path) -> None:
    x, faces = read_surface(folder / name)
    if len(faces) > FINE:
        assert (edge_counts(faces) == 2).all()
        return
    found = examine(x, faces)
    assert (found.problems(), found.components) == ([], 1)
    assert not found.flat


@pytest.mark.parametrize("name", FLAWED)
def test_a_flawed_surface_has_its_own_flaws_and_no_others(name: str, folder: Path) -> None:
    found = report(folder / name)
    flaws = [found.open_edges > 0, found.nonmanifold_edges > 0, found.intersecting > 0]
    assert (*flaws, found.components) == FLAWED[name]


@pytest.mark.parametrize(
    ("name", "size"), [("tiny.stl", 0.005), ("huge.stl", 170.0), ("figure.ply", 1.7)]
)
def test_it_is_as_large_as_its_name_says(name: str, size: float, folder: Path) -> None:
    assert extent(folder / name).max() == pytest.approx(size, rel=1e-6)


def test_thin_ones_are_thin_and_the_scan_is_fine(folder: Path) -> None:
    assert extent(folder / "plate.stl").min() == pytest.approx(0.003, rel=1e-5)
    assert len(read_surface(folder / "scan.stl")[1]) == 60_000
    ears, _ = read_surface(folder / "rabbit.ply")
    tops = ears[(ears[:, 2] > 0.12) & (ears[:, 1] > 0.0)]
    assert np.ptp(tops[:, 1]) < 0.008
    assert np.ptp(tops[:, 0]) > 2.0 * np.ptp(tops[:, 1])


TORUS = 2.0 * np.pi**2 * 0.06 * 0.025**2
ORGAN = 9.51e-4  # as examples/organ.ply


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("ball of latin_1.stl", 4.0 / 3.0 * np.pi * 0.05**3),
        ("cone.stl", np.pi * 0.05**2 * 0.12 / 3.0),
        ("cube.stl", 0.08**3),
        ("flipped.ply", None),
        ("inside_out.off", -TORUS),
        ("leaflet.stl", 0.2**2 * 0.001),
        ("millimetres.3mf", TORUS),
        ("mirrored.glb", ORGAN),
        ("nested.stl", 4.0 / 3.0 * np.pi * (0.05**3 - 0.03**3)),
        ("nested_nodes.glb", ORGAN),
        ("plate.stl", 0.12**2 * 0.003),
        ("quads.ply", TORUS),
        ("rod.stl", np.pi * 0.01**2 * 0.3),
        ("seams.obj", TORUS),
    ],
)
def test_it_encloses_the_volume_of_its_closed_form(
    name: str, expected: float | None, folder: Path
) -> None:
    enclosed = volume(*read_surface(folder / name.rpartition(" ")[2]))
    if expected is None:  # a third of its triangles count against the others
        assert 0.0 < enclosed < 2.5e-4
    else:
        assert enclosed == pytest.approx(expected, rel=0.03)


def test_strips_make_the_surface_of_the_quadrilaterals(folder: Path) -> None:
    head, _, body = (folder / "strips.ply").read_text().partition("end_header\n")
    assert "element tristrips 1" in head
    *rows, run = body.strip().splitlines()
    x = np.array([[float(v) for v in row.split()] for row in rows])
    count, *indices = map(int, run.split())
    assert count == len(indices)
    faces: list[tuple[int, ...]] = []
    for strip in " ".join(map(str, indices)).split("-1"):
        k = [int(i) for i in strip.split()]
        for j in range(len(k) - 2):
            faces.append((k[j], k[j + 1], k[j + 2]) if j % 2 == 0 else (k[j + 1], k[j], k[j + 2]))
    found = examine(x, np.array(faces))
    assert (found.problems(), found.components) == ([], 1)
    assert abs(found.volume) == pytest.approx(TORUS, rel=0.03)


def test_a_name_in_latin_1_is_no_utf_8(folder: Path) -> None:
    with pytest.raises(UnicodeDecodeError):
        (folder / "latin_1.stl").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", [name for name in MANY if Path(name).suffix in VOLUMES])
def test_a_volume_mesh_has_tetrahedra(name: str, folder: Path) -> None:
    x, tets, _ = read_volume(folder / name)
    a, b, c, d = (x[tets[:, k]] for k in range(4))
    assert (np.einsum("ti,ti->t", np.cross(b - a, c - a), d - a) > 0.0).all()


def test_marching_tetrahedra_find_a_ball_and_a_ring() -> None:
    box = np.full(3, 0.07)
    ball = blended([Limb((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.05, 0.05))], 1e-3)
    x, faces = surface(ball, -box, box, 0.004)
    assert np.linalg.norm(x, axis=1) == pytest.approx(0.05, rel=0.02)
    assert volume(x, faces) == pytest.approx(4.0 / 3.0 * np.pi * 0.05**3, rel=0.01)

    def ring(x: Floats) -> Floats:
        out = np.hypot(x[:, 0], x[:, 1]) - 0.045
        return np.asarray(0.012 - np.hypot(out, x[:, 2]))

    x, faces = surface(ring, -box, box, 0.004)
    found = examine(x, faces)
    assert (found.problems(), found.components) == ([], 1)
    assert len(x) - len(faces) // 2 == 0  # Euler's number of a torus
    assert found.volume == pytest.approx(2.0 * np.pi**2 * 0.045 * 0.012**2, rel=0.03)
