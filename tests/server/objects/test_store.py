from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cohaptic.errors import BodyError
from cohaptic_server.bodies.blocks import block
from cohaptic_server.objects import store
from cohaptic_server.objects.object_file import ObjectFile, Prepared
from cohaptic_server.objects.surface_checks import SurfaceReport

REPORT = SurfaceReport(1, 2, 3, 1, 0.5, 0.25)


@pytest.fixture
def made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[ObjectFile]:
    """What was made and not read, with a stand-in for the slow part."""
    calls: list[ObjectFile] = []

    def prepare(wanted: ObjectFile) -> Prepared:
        calls.append(wanted)
        return Prepared(block((0.1, 0.1, 0.1), (2, 2, 2)), REPORT)

    monkeypatch.setattr(store, "prepare", prepare)
    monkeypatch.setenv("COHAPTIC_CACHE", str(tmp_path / "store"))
    return calls


def test_the_second_time_it_is_read(made: list[ObjectFile], tmp_path: Path) -> None:
    wanted = ObjectFile(tmp_path / "a.stl")
    wanted.path.write_bytes(b"one")
    first, second = store.prepared(wanted), store.prepared(wanted)
    assert len(made) == 1
    assert np.array_equal(first.tets.vertices, second.tets.vertices)
    assert np.array_equal(first.tets.tets, second.tets.tets)
    assert second.surface == REPORT
    moved = tmp_path / "b.stl"
    moved.write_bytes(b"one")
    store.prepared(replace(wanted, path=moved))
    assert len(made) == 1  # the content counts, not the name


def test_other_content_or_other_wishes_are_made_anew(
    made: list[ObjectFile], tmp_path: Path
) -> None:
    wanted = ObjectFile(tmp_path / "a.stl")
    wanted.path.write_bytes(b"one")
    store.prepared(wanted)
    store.prepared(replace(wanted, scale=0.5))
    store.prepared(replace(wanted, edge=0.1))
    store.prepared(replace(wanted, repair=True))
    wanted.path.write_bytes(b"two")
    store.prepared(wanted)
    assert len(made) == 5


@pytest.mark.parametrize("damage", [b"", b"PK\x03\x04 nonsense", b"\x80\x04pickle"])
def test_a_damaged_store_is_made_anew(
    made: list[ObjectFile], tmp_path: Path, damage: bytes
) -> None:
    wanted = ObjectFile(tmp_path / "a.stl")
    wanted.path.write_bytes(b"one")
    store.prepared(wanted)
    store.place(wanted).write_bytes(damage)
    store.prepared(wanted)
    store.prepared(wanted)
    assert len(made) == 2


def test_a_store_that_cannot_be_written_changes_nothing(
    made: list[ObjectFile], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("COHAPTIC_CACHE", str(tmp_path / "file"))
    wanted = ObjectFile(tmp_path / "a.stl")
    wanted.path.write_bytes(b"one")
    assert store.prepared(wanted).tets.volume == pytest.approx(1e-3)
    assert len(made) == 1


def test_a_missing_file_is_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(BodyError, match="there is no such file"):
        store.prepared(ObjectFile(tmp_path / "a.stl"))
