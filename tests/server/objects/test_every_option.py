"""Every option of an object goes wherever it has to: an option that is forgotten is silent."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import pytest

from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.objects.inertia.inertia import Inertia
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_server.objects.parts.materials import PartMaterials
from cohaptic_server.objects.store.store import tets_path
from cohaptic_uploads.described import to_fields

# For each option a value that is not its default.
OTHER: dict[str, Any] = {
    "fix": "z < 7%",
    "scale": 0.01,
    "edge": 0.07,
    "repair": True,
    "material": SolidSettings(7e3, 0.41),
    "fix_mesh": Path("held.stl"),
    "simplify": 500,
    "shell": 0.002,
    "max_memory": 3e9,
    "max_time": 77.0,
    "parts": PartMaterials((("bone", 9e3),)),
    "labels": ("3",),
    "inertia": Inertia(1000.0),
}
# Options that decide which tetrahedra a file becomes; the others are applied to these.
OF_TETRAHEDRA = {"scale", "edge", "repair", "simplify", "shell", "labels"}
# Options that a page does not offer.
NOT_OF_PAGES = {"fix_mesh", "max_memory", "max_time", "parts", "inertia"}


@pytest.fixture
def plain(tmp_path: Path) -> ObjectFile:
    path = tmp_path / "a.stl"
    path.write_bytes(b"solid")
    return ObjectFile(path, "z < 5%")


def test_each_option_is_tried() -> None:
    assert set(OTHER) == {option.name for option in fields(ObjectFile)} - {"path"}


@pytest.mark.parametrize("name", OTHER)
def test_an_option_is_in_the_command_that_serves_the_object_again(
    name: str, plain: ObjectFile
) -> None:
    changed = replace(plain, **{name: OTHER[name]})
    assert changed.to_arguments() != plain.to_arguments()


@pytest.mark.parametrize("name", OTHER)
def test_an_option_of_a_page_comes_from_the_worker_to_the_server(
    name: str, plain: ObjectFile
) -> None:
    changed = replace(plain, **{name: OTHER[name]})
    assert (to_fields(changed) != to_fields(plain)) == (name not in NOT_OF_PAGES)


@pytest.mark.parametrize("name", OTHER)
def test_tetrahedra_are_stored_under_what_decides_them(name: str, plain: ObjectFile) -> None:
    changed = replace(plain, **{name: OTHER[name]})
    assert (tets_path(changed) != tets_path(plain)) == (name in OF_TETRAHEDRA)
