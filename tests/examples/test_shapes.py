"""The many shapes are what their names say, and the same each time."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

import make_objects
from cohaptic_server.mesh.enclosed_volume import volume
from cohaptic_server.objects.surface.checks import SurfaceReport, edge_counts, examine
from cohaptic_server.objects.surface.surface_file import read_surface
from cohaptic_server.objects.volume_file import read_volume
from cohaptic_server.touchable import SURFACES, VOLUMES
from shapes.catalogue import MANY

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


@pytest.mark.parametrize("name", [name for name in MANY if Path(name).suffix in VOLUMES])
def test_a_volume_mesh_has_tetrahedra(name: str, folder: Path) -> None:
    x, tets, _ = read_volume(folder / name)
    a, b, c, d = (x[tets[:, k]] for k in range(4))
    assert (np.einsum("ti,ti->t", np.cross(b - a, c - a), d - a) > 0.0).all()
