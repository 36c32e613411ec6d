"""A softness with which a press is felt: of an object of any size, however it is held."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cohaptic_server.bodies.solid import parts
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.bodies.touched_body import vertex_compliance
from cohaptic_server.objects.auto import softness
from cohaptic_server.objects.auto.resolve import resolve
from cohaptic_server.objects.auto.softness import MATERIALS, fitting_young, softness_words
from cohaptic_server.objects.build import build
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_server.objects.store import store
from cohaptic_server.testing.blocks import block
from cohaptic_server.touchable import YOUNG

meshio: Any = pytest.importorskip("meshio", reason="pip install 'cohaptic[objects]' reads volumes")

PAGE = Path(__file__).parents[4] / "web/src/upload/softness.ts"


def tower(young: float = YOUNG, size: float = 1.0, held: float = 0.0) -> Solid:
    """A tower of 60 x 60 x 140 mm times `size` that is held up to a height [m]."""
    tets = block((0.06 * size, 0.06 * size, 0.14 * size), (4, 4, 8))
    return Solid(tets, tets.vertices[:, 2] <= held, SolidSettings(young, order=1))


def middle(solid: Solid) -> float:
    """Stiffness at the median vertex that is free [N/m]."""
    table = vertex_compliance(solid)
    return 1.0 / float(np.median(table[table > 0.0]))


def test_a_usual_place_then_has_the_stiffness_of_a_press_of_a_few_newtons() -> None:
    wanted = softness.PRESS / softness.DENT
    for held in (0.0, 0.06):  # a part that is held is not pressed
        fitting = fitting_young(tower(held=held), YOUNG)
        assert middle(tower(fitting, held=held)) == pytest.approx(wanted, rel=0.1)


@pytest.mark.parametrize(
    ("young", "words"),
    [
        (1e3, "softer than jelly, 1 kPa"),
        (6e3, "like liver, 6 kPa"),
        (3e4, "softer than silicone, 30 kPa"),
        (1.3e4, "harder than liver, 13 kPa"),
        (2.4e5, "harder than silicone, 240 kPa"),
        (1e6, "like rubber, 1 MPa"),
        (4e7, "harder than rubber, 40 MPa"),
    ],
)
def test_a_softness_is_told_by_a_material(young: float, words: str) -> None:
    assert softness_words(young) == words


def test_the_page_has_the_same_materials() -> None:
    rows = re.findall(r'name: "(\w+)", young: ([\d.e]+)', PAGE.read_text())
    assert [(name, float(young)) for name, young in rows] == list(MATERIALS)


@pytest.fixture
def volume(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> ObjectFile:
    monkeypatch.setenv("COHAPTIC_CACHE", str(tmp_path / "store"))
    tets, path = block((0.06, 0.06, 0.14), (3, 3, 6)), tmp_path / "a.vtk"
    meshio.Mesh(tets.vertices, [("tetra", tets.tets)]).write(path)
    return ObjectFile(path, "z < 5%", material=SolidSettings(order=1))


def test_auto_chooses_it_tells_it_and_factors_once(
    volume: ObjectFile, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[object] = []

    def make_parts(*arguments: Any) -> Any:
        made.append(arguments)
        return parts.make_parts(*arguments)

    monkeypatch.setattr(store, "make_parts", make_parts)
    found = resolve(volume, softness=True)
    young = found.source.material.young
    assert young != YOUNG
    assert f"--young {young:g}" in found.options
    assert softness_words(young) in found.remedies[-1].sentence()
    solid = build(found.source).solid
    assert len(made) == 1
    assert middle(solid) == pytest.approx(softness.PRESS / softness.DENT, rel=0.1)
    assert resolve(volume, softness=True) == found  # from the store
    assert resolve(volume).source.material.young == YOUNG
