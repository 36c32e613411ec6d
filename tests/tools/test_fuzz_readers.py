"""Damaged files of every format: each is refused in a sentence, or read as a solid.

What fails here is kept with its seed by `python tools/fuzz_readers.py`, which also makes it short.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from random import Random

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.errors import BodyError
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.objects import prepare
from cohaptic_server.touchable import KINDS
from fuzz_readers import main
from fuzzing import judging
from fuzzing.campaign import fuzz, shrunk
from fuzzing.cases import KINDS as FUZZED
from fuzzing.cases import Case, case, cases, drafts
from fuzzing.drafts import Draft
from fuzzing.judging import (
    DIED,
    FAULTS,
    GARBAGE,
    HUNG,
    MEMORY,
    NO_VOLUME,
    OTHER_VOLUME,
    READ,
    REFUSED,
    TRACEBACK,
    UNNAMED,
    WARNED,
    Verdict,
    judge,
    wrong_solid,
    wrong_surface,
)
from fuzzing.mutations import LONGEST, MUTATIONS, mutated
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
def test_so_are_twenty_thousand_within_their_memory_and_time(tmp_path: Path) -> None:
    with Worker(FUZZED) as worker:
        report = fuzz(cases(20_000, SEED), worker.judge, tmp_path)
    assert not report.faults, report.kept
    for kind in FUZZED:
        assert report.states[kind, READ] > 50
        assert report.states[kind, REFUSED] > 200


@given(st.sampled_from(FUZZED), st.integers(0, 2**32), st.integers(0, 10**6))
def test_a_seed_and_a_number_draw_the_same_file(kind: str, seed: int, number: int) -> None:
    one, again = case(kind, seed, number), case(kind, seed, number)
    assert one.name == again.name
    assert one.draft.packed() == again.draft.packed()
    assert one.name.endswith(kind)
    assert one.faults


def test_some_formats_are_fuzzed_as_they_are_among_all() -> None:
    among = [one for one in cases(5 * len(FUZZED), SEED) if one.kind == ".ply"]
    alone = list(cases(5, SEED, [".ply"]))
    assert [one.name for one in among] == [one.name for one in alone]


@given(st.binary(min_size=1), st.sampled_from(sorted(MUTATIONS)), st.integers(0, 2**32))
def test_a_mutation_takes_any_bytes(data: bytes, name: str, seed: int) -> None:
    found = MUTATIONS[name](data, Random(seed))
    assert found == MUTATIONS[name](data, Random(seed))
    assert len(found) <= len(data) + max(len(data) + 10, LONGEST)


def test_faults_also_reach_what_is_packed() -> None:
    """A flipped bit in a gzip stream would only spoil its checksum."""
    unpacked = 0
    for number in range(40):
        draft, _ = mutated(drafts(".nii.gz")[0], Random(number))
        unpacked += draft.packed() == draft.pack(draft.pieces) and len(draft.pieces) == 2
    assert unpacked > 20


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


def one_piece(data: bytes) -> Draft:
    return Draft("a", (data,), 1.0)


@given(st.binary(max_size=60), st.binary(min_size=1, max_size=4), st.binary(max_size=60))
def test_what_is_shrunk_has_what_fails_and_no_byte_more(
    before: bytes, needed: bytes, behind: bytes
) -> None:
    short = shrunk(one_piece(before + needed + behind), lambda d: needed in d.packed(), 10_000)
    assert short.packed() == needed


@given(st.integers(0, 40))
def test_no_more_is_tried_than_allowed(tries: int) -> None:
    tried: list[Draft] = []

    def fails(draft: Draft) -> bool:
        tried.append(draft)
        return False

    shrunk(one_piece(bytes(100)), fails, tries)
    assert len(tried) <= tries


def test_two_files_of_a_fault_are_kept_and_all_are_counted(tmp_path: Path) -> None:
    def spoilt(path: Path, simplify: int = 0) -> Verdict:
        return Verdict(TRACEBACK, "KeyError", "here") if path.read_bytes() else Verdict(REFUSED)

    some = [Case(".stl", 1, k, one_piece(b"abcdef"), ("flip",), 0) for k in range(5)]
    report = fuzz(some, spoilt, tmp_path)
    assert report.row([".stl"]) == {"files": 5, READ: 0, REFUSED: 0} | {
        fault: 5 if fault == TRACEBACK else 0 for fault in FAULTS
    }
    assert sorted(file.name for file in tmp_path.iterdir()) == [
        "seed1-000000-flip.stl", "seed1-000001-flip.stl",
    ]  # fmt: skip
    assert [len(file.read_bytes()) for file in tmp_path.iterdir()] == [1, 1]


def behaves(path: Path, simplify: int = 0) -> Verdict:
    """What the content of a file asks for; runs in the process of a worker."""
    asked = path.read_bytes()
    if asked == b"hang":
        while True:
            pass
    if asked == b"die":
        os._exit(7)
    if asked == b"eat":
        bytearray(2 * 10**9)
    return Verdict(READ)


@pytest.mark.live
@pytest.mark.skipif(sys.platform != "linux", reason="only Linux limits a process")
def test_a_worker_outlives_what_files_do_to_it(tmp_path: Path) -> None:
    found: list[Verdict] = []
    with Worker([".stl"], 1, behaves) as worker:
        for asked in (b"", b"hang", b"die", b"eat", b""):
            (tmp_path / "a").write_bytes(asked)
            found.append(worker.judge(tmp_path / "a"))
    assert [verdict.state for verdict in found] == [READ, HUNG, DIED, MEMORY, READ]
    assert found[2].words == "the process ended with 7"


@pytest.mark.live
def test_the_command_writes_a_table(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "report.json"
    words = ["--count", "6", "--format", ".off", ".stl", "--keep", str(tmp_path / "kept")]
    assert main([*words, "--json", str(file)]) == 0
    said = capsys.readouterr()
    assert [line.split()[:2] for line in said.out.splitlines()] == [
        ["format", "files"], [".off", "3"], [".stl", "3"], ["all", "6"],
    ]  # fmt: skip
    assert "6 of 6 files, 0 faults" in said.err
    report = json.loads(file.read_text(encoding="utf-8"))
    assert report["formats"][".off"]["files"] == 3
    assert not (tmp_path / "kept").exists()
