"""Every option of an object goes wherever it has to: an option that is forgotten is silent."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Any

import pytest

from cohaptic.protocol.upload_messages import PrepareObject
from cohaptic_server.objects.object_file import OPTIONS, ObjectFile
from cohaptic_server.objects.option import PartOption
from cohaptic_server.objects.store.store import tets_path
from cohaptic_uploads.described import to_fields

# For each option a value that is not its default, as it is given.
OTHER: dict[str, Any] = {
    "young": ["7e3"],
    "poisson": ["0.41", "bone=0.3"],
    "fix": "z < 7%",
    "fix_mesh": Path("held.stl:mm:lps"),
    "scale": 0.01,
    "edge": 0.07,
    "order": 1,
    "contact_radius": 0.02,
    "repair": True,
    "simplify": 500,
    "shell": 0.002,
    "max_memory": 3.0,
    "max_time": 77.0,
    "label": ["3"],
    "density": ["1000.0"],
    "damping_ratio": 0.3,
}
# Options that decide which tetrahedra a file becomes; the others are applied to these.
OF_TETRAHEDRA = {"scale", "edge", "repair", "simplify", "shell", "label"}
# Options that neither a visitor nor the process that reads an upload chooses.
NOT_OF_PAGES = {
    "fix_mesh", "contact_radius", "max_memory", "max_time", "density", "damping_ratio",
}  # fmt: skip


@pytest.fixture
def plain(tmp_path: Path) -> ObjectFile:
    path = tmp_path / "a.stl"
    path.write_bytes(b"solid")
    return ObjectFile(path, "z < 5%")


def with_other(plain: ObjectFile, name: str) -> ObjectFile:
    """The plain object with another value of one option."""
    return ObjectFile.of(plain.path, {"fix": plain.fix, name: OTHER[name]})


def test_no_field_of_an_object_is_without_an_option() -> None:
    plain = ObjectFile(Path("a.stl"))
    expected = {one.name for one in fields(plain)} - {"path", "material", "parts", "inertia"}
    for group in ("material", "parts", "inertia"):
        expected |= {f"{group}.{one.name}" for one in fields(getattr(plain, group))}
    reached = {option.attribute for option in OPTIONS}
    for option in OPTIONS:
        if isinstance(option, PartOption):
            reached |= {option.parts, option.every} - {""}
    assert reached == expected - {"material.cache"}  # of the solver, not of the object


@pytest.mark.parametrize("option", OPTIONS, ids=lambda option: option.name)
def test_a_default_of_the_command_line_is_that_of_an_object(option: Any) -> None:
    plain = ObjectFile(Path("a.stl"))
    given = {} if option.absent is None else {option.name: option.absent}
    assert ObjectFile.of(plain.path, given) == plain


@pytest.mark.parametrize("name", OTHER)
def test_an_option_is_in_the_command_that_serves_the_object_again(
    name: str, plain: ObjectFile
) -> None:
    changed = with_other(plain, name)
    assert changed != plain
    assert changed.to_arguments() != plain.to_arguments()


@pytest.mark.parametrize("name", OTHER)
def test_an_option_of_a_page_comes_from_the_worker_to_the_server(
    name: str, plain: ObjectFile
) -> None:
    changed = with_other(plain, name)
    assert (to_fields(changed) != to_fields(plain)) == (name not in NOT_OF_PAGES)


def test_a_page_offers_the_options_that_are_said_to_be_of_pages() -> None:
    offered = {option.name for option in OPTIONS if option.page}
    assert set(PrepareObject.model_fields) == offered | {"type"}


@pytest.mark.parametrize("name", OTHER)
def test_tetrahedra_are_stored_under_what_decides_them(name: str, plain: ObjectFile) -> None:
    changed = with_other(plain, name)
    assert (tets_path(changed) != tets_path(plain)) == (name in OF_TETRAHEDRA)


def test_tetrahedra_that_an_earlier_version_has_stored_are_found(tmp_path: Path) -> None:
    """Filling took minutes: these names are those of entries that exist."""
    path = tmp_path / "a.stl"
    path.write_bytes(b"solid")
    assert tets_path(ObjectFile(path)).name == "60e70dd1b36da77e4688c4591a228441.arrays"
    given = {
        "scale": 0.001, "edge": 0.1, "repair": True, "simplify": 4000, "shell": 0.01,
        "label": ["1"],
    }  # fmt: skip
    assert tets_path(ObjectFile.of(path, given)).name == "4c9b69d99cc6602f6e142efdd6abb018.arrays"
