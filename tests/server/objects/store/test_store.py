from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cohaptic_server.bodies.solid import parts as solid_parts
from cohaptic_server.bodies.solid.green_columns import ColumnRequest
from cohaptic_server.bodies.solid.parts import SolidParts
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.cholesky.factor import Factor
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_server.objects.prepare import Prepared
from cohaptic_server.objects.store import store
from cohaptic_server.objects.store.cache import save_arrays
from cohaptic_server.objects.store.store import StoredFactor
from cohaptic_server.objects.surface.checks import SurfaceReport
from cohaptic_server.progress import Progress
from cohaptic_server.testing.blocks import block

SETTINGS = SolidSettings(order=1)
REPORT = SurfaceReport(1, 2, 3, 1, 0.5, 0.25)
BLOCK = block((0.1, 0.1, 0.1), (2, 2, 2))
FOOT = BLOCK.vertices[:, 2] <= 0.0


@pytest.fixture
def made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[ObjectFile]:
    """Records each object that is made anew; filling a surface is replaced by a stand-in."""
    calls: list[ObjectFile] = []

    def prepare(source: ObjectFile, progress: Progress) -> Prepared:
        del progress
        calls.append(source)
        return Prepared(BLOCK, REPORT, 96, 80)

    def make_parts(*arguments: Any) -> SolidParts:
        calls.append(ObjectFile(Path()))
        return solid_parts.make_parts(*arguments)

    monkeypatch.setattr(store, "prepare", prepare)
    monkeypatch.setattr(store, "make_parts", make_parts)
    monkeypatch.setenv("COHAPTIC_CACHE", str(tmp_path / "store"))
    return calls


def test_the_second_time_it_is_read(made: list[ObjectFile], tmp_path: Path) -> None:
    source = ObjectFile(tmp_path / "a.stl")
    source.path.write_bytes(b"one")
    first, second = store.load_or_prepare(source), store.load_or_prepare(source)
    assert len(made) == 1
    assert np.array_equal(first.tets.vertices, second.tets.vertices)
    assert np.array_equal(first.tets.tets, second.tets.tets)
    assert (second.surface, second.triangles, second.simplified) == (REPORT, 96, 80)
    moved = tmp_path / "b.stl"
    moved.write_bytes(b"one")
    store.load_or_prepare(replace(source, path=moved))
    assert len(made) == 1  # the content counts, not the name


@pytest.mark.parametrize("damage", [b"", b"PK\x03\x04 nonsense", b"\x80\x04pickle"])
def test_a_damaged_store_is_made_anew(
    made: list[ObjectFile], tmp_path: Path, damage: bytes
) -> None:
    source = ObjectFile(tmp_path / "a.stl")
    source.path.write_bytes(b"one")
    store.load_or_prepare(source)
    (path,) = (tmp_path / "store").iterdir()
    path.write_bytes(damage)
    store.load_or_prepare(source)
    store.load_or_prepare(source)
    assert len(made) == 2


def quietly(phase: str, fraction: float) -> None:
    del phase, fraction


def test_a_solid_of_stored_parts_is_the_same(made: list[ObjectFile]) -> None:
    phases: list[str] = []
    first = store.load_or_make_parts(
        BLOCK, FOOT, SETTINGS, lambda phase, fraction: phases.append(phase)
    )
    assert list(dict.fromkeys(phases)) == ["factoring", "pressing", "storing"]
    second = store.load_or_make_parts(BLOCK, FOOT, SETTINGS, quietly)
    assert len(made) == 1
    tables = [Solid(BLOCK, FOOT, SETTINGS, parts=p).vertex_compliance() for p in (first, second)]
    order = ColumnRequest(np.arange(20, 24), np.arange(1))
    columns = [Solid(BLOCK, FOOT, SETTINGS, parts=p).columns.solve(order) for p in (first, second)]
    assert np.array_equal(tables[0], tables[1])
    for one, other in zip(*columns, strict=True):
        assert np.array_equal(one.values, other.values)


# The file of a factor that is read late stays open.
@pytest.mark.filterwarnings("ignore:Exception ignored in. <_io.FileIO")
@pytest.mark.parametrize("late", [False, True])
def test_an_object_of_another_softness_is_a_multiple_of_the_stored_one(
    made: list[ObjectFile], *, late: bool
) -> None:
    """To the digits of single precision, in which a factor is stored."""
    store.load_or_make_parts(BLOCK, FOOT, SETTINGS, quietly)
    harder = replace(SETTINGS, young=7.3e5)
    stored = store.load_or_make_parts(BLOCK, FOOT, harder, quietly, late=late)
    assert len(made) == 1
    anew = solid_parts.make_parts(BLOCK, FOOT, harder)
    assert np.array_equal(stored.shape.moduli.young, anew.shape.moduli.young)
    one, other = (Solid(BLOCK, FOOT, harder, parts=p) for p in (stored, anew))
    assert one.vertex_compliance() == pytest.approx(other.vertex_compliance(), rel=1e-9)
    assert stored.far_field.compliance == pytest.approx(anew.far_field.compliance, rel=1e-6)
    factor = stored.factor.read() if isinstance(stored.factor, StoredFactor) else stored.factor
    assert isinstance(anew.factor, Factor)
    assert isinstance(factor, Factor)
    nodes, forces = np.array([3, 4]), np.arange(12.0).reshape(6, 2)
    wanted = anew.factor.solve(nodes, forces)
    assert factor.solve(nodes, forces) == pytest.approx(wanted, rel=1e-4, abs=1e-6 * wanted.max())


def test_parts_of_another_form_are_made_anew_with_a_word(
    made: list[ObjectFile], tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """A whole file, but of something else."""
    store.load_or_make_parts(BLOCK, FOOT, SETTINGS, quietly)
    (path,) = (tmp_path / "store").iterdir()
    save_arrays(path, {"twin/places": np.arange(3)})
    store.load_or_make_parts(BLOCK, FOOT, SETTINGS, quietly)
    assert len(made) == 2
    assert "the stored factor cannot be used and is made anew" in caplog.text
    store.load_or_make_parts(BLOCK, FOOT, SETTINGS, quietly)
    assert len(made) == 2
