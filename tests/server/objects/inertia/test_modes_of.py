from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cohaptic.errors import BodyError
from cohaptic_server.bodies.body import elastic_of
from cohaptic_server.bodies.modal.modal_body import HIGHEST, LARGEST, ModalBody
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.objects.build import build
from cohaptic_server.objects.catalogue import build_body
from cohaptic_server.objects.inertia import modes_of
from cohaptic_server.objects.inertia.inertia import Inertia
from cohaptic_server.objects.inertia.modes_of import with_inertia
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_server.objects.store.cache import save_entry
from cohaptic_server.testing.blocks import block

meshio = pytest.importorskip("meshio", reason="pip install 'cohaptic[objects]' reads volumes")


@pytest.fixture
def jelly(tmp_path: Path) -> ObjectFile:
    """A soft block in a file, held at its base, with water's density."""
    tets = block((0.06, 0.06, 0.12), (2, 2, 4))
    path = tmp_path / "jelly.vtu"
    meshio.Mesh(tets.vertices, [("tetra", tets.tets)]).write(path)
    return ObjectFile(path, "z <= 0%", material=SolidSettings(6e3), inertia=Inertia(1000.0))


def test_a_soft_object_with_a_density_swings(jelly: ObjectFile) -> None:
    body = build_body(str(jelly.path), jelly, hz=50.0)
    assert isinstance(body, ModalBody)
    assert body.dt == 1.0 / 50.0
    assert isinstance(elastic_of(body), Solid)
    assert 1 <= len(body.modes) <= LARGEST
    assert (body.modes.frequency < 2.0 * np.pi * HIGHEST).all()
    assert (np.diff(body.modes.frequency) >= 0.0).all()
    # Four times as heavy it is half as fast.
    heavy = build_body(str(jelly.path), replace(jelly, inertia=Inertia(4000.0)))
    assert isinstance(heavy, ModalBody)
    assert heavy.modes.frequency[0] == pytest.approx(0.5 * body.modes.frequency[0], rel=1e-5)


def test_damaged_modes_are_found_again(jelly: ObjectFile, monkeypatch: pytest.MonkeyPatch) -> None:
    built = build(jelly)
    kept: list[Path] = []

    def spoilt(path: Path, label: str, arrays: dict[str, Any]) -> None:
        kept.append(path)
        save_entry(path, label, arrays | {"shapes": np.full((1, 2, 3), np.nan)})

    with monkeypatch.context() as patched:
        patched.setattr(modes_of, "save_entry", spoilt)
        first = with_inertia(built, jelly, 60.0)
    assert kept
    again = with_inertia(built, jelly, 60.0)
    assert isinstance(first, ModalBody)
    assert isinstance(again, ModalBody)
    assert again.modes.frequency == pytest.approx(first.modes.frequency)


def test_modes_that_take_too_much_memory_are_refused(
    jelly: ObjectFile, monkeypatch: pytest.MonkeyPatch
) -> None:
    built = build(jelly)
    monkeypatch.setattr(modes_of, "natural_modes", _that_asks)
    with pytest.raises(BodyError, match=r"the natural modes of .* tetrahedra"):
        with_inertia(built, replace(jelly, max_memory=0.5e9), 60.0)


def _that_asks(*arguments: object) -> None:
    """Ask for a plan of a size that no such limit allows."""
    from cohaptic_server.bodies.solid.parts import plan_of_solid
    from cohaptic_server.bodies.solid.shape import SolidShape

    shape, accept = arguments[0], arguments[-1]
    assert isinstance(shape, SolidShape)
    assert callable(accept)
    accept(replace(plan_of_solid(shape), peak_bytes=10**9))
