"""Damaged files of every format: each is refused in a sentence, or read as a solid.

What fails here is kept with its seed by `python tools/fuzz_readers.py`, which also makes it short.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cohaptic.errors import BodyError
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.objects import prepare
from cohaptic_server.touchable import KINDS
from fuzzing import judging
from fuzzing.campaign import fuzz
from fuzzing.cases import KINDS as FUZZED
from fuzzing.cases import cases, drafts
from fuzzing.judging import (
    GARBAGE,
    MEMORY,
    NO_VOLUME,
    OTHER_VOLUME,
    READ,
    REFUSED,
    TRACEBACK,
    UNNAMED,
    WARNED,
    judge,
    wrong_solid,
    wrong_surface,
)
from fuzzing.shapes import SIZE, ball, block
from fuzzing.worker import Worker

pytest.importorskip("nibabel", reason="pip install 'cohaptic[scans]' reads label maps")

FILES = 300
SEED = 7


def test_every_format_that_is_read_is_fuzzed() -> None:
    assert set(FUZZED) == set(KINDS)


@pytest.mark.parametrize("kind", FUZZED)
def test_without_a_fault_each_file_is_read_with_its_volume(kind: str, tmp_path: Path) -> None:
    for draft in drafts(kind):
        file = tmp_path / f"a{kind}"
        file.write_bytes(draft.packed())
        found = judge(file)
        assert found.state == READ, (draft.name, found.words)
        assert found.volume == pytest.approx(draft.volume, rel=draft.within), draft.name


@pytest.mark.parametrize("kind", FUZZED)
def test_a_damaged_file_is_refused_in_a_sentence_or_is_a_solid(kind: str) -> None:
    report = fuzz(cases(1 + FILES // len(FUZZED), SEED, [kind]), judge)
    assert not report.faults
    assert report.states[kind, REFUSED] > 0


@pytest.mark.night
def test_twenty_thousand_fuzzed_files_are_read_or_refused_within_memory_and_time(
    tmp_path: Path,
) -> None:
    with Worker(FUZZED) as worker:
        report = fuzz(cases(20_000, SEED), worker.judge, tmp_path)
    assert not report.faults, report.kept
    for kind in FUZZED:
        assert report.states[kind, READ] > 50
        assert report.states[kind, REFUSED] > 200


def test_each_fault_is_told_from_the_others(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    file = tmp_path / "a.stl"
    file.write_bytes(drafts(".stl")[0].packed())
    assert judge(file).state == READ
    errors: list[tuple[Exception, str]] = [
        (BodyError(f"{file}: it is small"), REFUSED),
        (BodyError("it is small"), UNNAMED),
        (BodyError(f"{file}: it is\nsmall"), UNNAMED),
        (MemoryError(), MEMORY),
        (KeyError("x"), TRACEBACK),
    ]
    for error, state in errors:

        def fails(*_: object, error: Exception = error) -> None:
            raise error

        monkeypatch.setattr(prepare, "check_size", fails)
        found = judge(file)
        assert found.state == state
        assert found.bad == (state != REFUSED)
    monkeypatch.undo()

    def warns(*_: object) -> None:
        np.array([np.nan]).astype(np.int64)

    monkeypatch.setattr(prepare, "check_size", warns)
    assert judge(file).state == WARNED

    def finds(*_: object) -> list[str]:
        return ["the points lie in a plane"]

    monkeypatch.setattr(judging, "wrong_surface", finds)
    assert judge(file).state == GARBAGE


SOLID = ball(1)
NO_SURFACES = [
    (SOLID.x * np.nan, SOLID.faces, "a point is not finite"),
    (SOLID.x[1:], SOLID.faces, "a cell names a point that is not there"),
    (np.vstack([SOLID.x, SOLID.x]), SOLID.faces, "a point belongs to no cell"),
    (SOLID.x * [1.0, 1.0, 0.0], SOLID.faces, "the points lie in a plane"),
    (SOLID.x, np.vstack([SOLID.faces, SOLID.faces[:, ::-1]]), "it encloses no volume"),
]


@pytest.mark.parametrize(("x", "faces", "words"), NO_SURFACES)
def test_a_surface_that_encloses_no_solid_is_found(x: Floats, faces: Ints, words: str) -> None:
    assert list(wrong_surface(SOLID.x, SOLID.faces)) == []
    assert list(wrong_surface(x, faces)) == [words]


def test_tetrahedra_that_make_no_solid_are_found() -> None:
    whole = block((2, 2, 2))
    assert list(wrong_solid(whole.x, whole.tets)) == []
    assert list(wrong_solid(whole.x, whole.tets[:, [0, 2, 1, 3]])) == [NO_VOLUME]
    folded = whole.x.copy()
    (inner,) = np.flatnonzero((folded == 0.5 * SIZE).all(axis=1))
    folded[inner] = 1.4 * SIZE
    tets = whole.tets.copy()
    turned = np.linalg.det(folded[tets[:, 1:]] - folded[tets[:, :1]]) < 0.0
    tets[turned] = tets[turned][:, [0, 2, 1, 3]]
    assert list(wrong_solid(folded, tets)) == [OTHER_VOLUME]
