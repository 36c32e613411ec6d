"""The nightly script says of each file what became of it: a short run, and its judgements."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import many_objects
from limited import Ended
from shapes.catalogue import MANY

pytestmark = pytest.mark.live

ROOT = Path(__file__).parents[2]
READY = "a.stl: 7,108 tetrahedra, 500 vertices of surface, 9 MB; ready in /x after 9.1 s\n"
SESSION = {
    "delay_s": 0.0, "force_error": 0.01, "felt_error": 0.02, "late_error": 0.01, "rest": "rests",
    "press_n": 2.0, "felt_n": 0.5,
}  # fmt: skip
OFF = {**SESSION, "force_error": 0.319}
LATER = {**SESSION, "late_error": 0.3}
UNFELT, UNPRESSED = {**SESSION, "felt_n": 0.04}, {**SESSION, "press_n": 0.04, "felt_n": 0.04}


def ended(code: int = 0, out: str = "", err: str = "", over: str = "") -> Ended:
    return Ended(code, 1.0, 1.0, 2e8, over, out, err)


@pytest.mark.parametrize(
    ("end", "expected"),
    [
        (ended(out=READY), ("accepted", "")),
        (ended(out="closed 3 holes\nscaled\n" + READY), ("accepted", "closed 3 holes; scaled")),
        (ended(2, err="cohaptic: a.stl: it\nis empty\n"), ("refused", "a.stl: it is empty")),
        (ended(1, err="Traceback ...\nKeyError: 3\n"), ("crashed", "ended with 1: KeyError: 3")),
        (ended(-11), ("crashed", "ended with -11: without a word")),
        (ended(2, err="Usage: ...\nNo option -a\n"), ("crashed", "ended with 2: No option -a")),
        (ended(0, out="nothing of it"), ("crashed", "ended with 0: without a word")),
        (ended(-9, out=READY, over="stopped after 120 s"), ("stopped", "stopped after 120 s")),
    ],
)
def test_a_preparation_is_judged_by_how_it_ended(end: Ended, expected: tuple[str, str]) -> None:
    found = many_objects.judge(end)
    assert (found["verdict"], found["said"]) == expected


@pytest.mark.parametrize(
    ("row", "sound"),
    [
        ({"verdict": "refused"}, True),
        ({"verdict": "crashed"}, False),
        ({"verdict": "stopped"}, False),
        ({"verdict": "accepted", "linear": {"sessions": [SESSION]}}, True),
        ({"verdict": "accepted", "linear": {"sessions": [{**SESSION, "rest": "slow"}]}}, True),
        ({"verdict": "accepted", "linear": {"sessions": [{**SESSION, "rest": "unstable"}]}}, False),
        ({"verdict": "accepted", "linear": {"sessions": [OFF]}}, False),
        ({"verdict": "accepted", "nonlinear": {"sessions": [SESSION, OFF]}}, False),
        ({"verdict": "accepted", "linear": {"sessions": [LATER, SESSION]}}, False),
        ({"verdict": "accepted", "linear": {"sessions": [UNFELT]}}, False),
        ({"verdict": "accepted", "linear": {"sessions": [UNPRESSED]}}, False),
        ({"verdict": "accepted", "linear": {"sessions": [SESSION], "error": "no place"}}, False),
    ],
)
def test_only_a_sentence_or_stable_sessions_with_the_right_force_are_sound(
    row: dict[str, Any], sound: bool
) -> None:
    assert many_objects.is_sound(row) is sound


def test_every_row_has_a_cell_for_each_column() -> None:
    row: dict[str, Any] = {"file": "a.stl", "verdict": "refused", "seconds": 1.0, "said": "a | b"}
    row["memory_bytes"] = row["processor_seconds"] = float("nan")
    for kinds in (["linear"], ["linear", "nonlinear-limb"]):
        assert len(many_objects.cells(row, kinds)) == 8 + 5 * len(kinds)
    assert "|" not in "".join(many_objects.cells(row, ["linear"]))


def test_the_force_and_the_share_that_is_felt_are_told() -> None:
    row: dict[str, Any] = {
        "file": "a.stl", "verdict": "accepted", "seconds": 1.0, "said": "", "tetrahedra": 9,
        "memory_bytes": 1e9, "processor_seconds": 1.0, "linear": {"sessions": [SESSION]},
    }  # fmt: skip
    assert many_objects.cells(row, ["linear"])[9:11] == ["2 N", "25%"]


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    (tmp_path / "a.stl").write_bytes(b"")
    (tmp_path / "b.nii.gz").write_bytes(b"")
    assert [p.name for p in many_objects.files_in(tmp_path, [])] == ["a.stl", "b.nii.gz"]
    assert [p.name for p in many_objects.files_in(tmp_path, ["a"])] == ["a.stl"]
    assert [p.name for p in many_objects.files_in(tmp_path, ["b"])] == ["b.nii.gz"]
    with pytest.raises(SystemExit, match="there is no mesh c"):
        many_objects.files_in(tmp_path, ["a", "c"])
    with pytest.raises(SystemExit, match="there is no such folder"):
        many_objects.files_in(tmp_path / "b", [])


@pytest.mark.night
@pytest.mark.timeout(600)
def test_a_short_night(tmp_path: Path) -> None:
    """One object that is touched, an empty file and one of strips that are refused."""
    (tmp_path / "block.vtu").write_bytes(MANY["block.vtu"]())
    (tmp_path / "nothing.stl").write_bytes(b"")
    (tmp_path / "strips.ply").write_bytes(MANY["strips.ply"]())
    done = subprocess.run(
        [
            *(sys.executable, str(ROOT / "benchmarks/many_objects.py"), str(tmp_path)),
            *("--kinds", "linear", "limb", "--jobs", "2", "--json", str(tmp_path / "out.json")),
        ],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "3 files: 1 accepted, 2 refused in a sentence; all are sound" in done.stdout
    accepted, nothing, strips = json.loads((tmp_path / "out.json").read_text())["results"]
    assert accepted["tetrahedra"] > 1440  # those of the file, some cut where the base ends
    assert accepted["memory_bytes"] > 5e7
    for kind in ("linear", "limb"):
        sessions = accepted[kind]["sessions"]
        assert [s["delay_s"] for s in sessions] == [0.0, 0.08, 0.25]
        assert {s["rest"] for s in sessions} == {"rests"}
        assert max(s["force_error"] for s in sessions) < 0.02
    assert accepted["linear"]["places"] != accepted["limb"]["places"]
    assert accepted["linear"]["share_within_5_percent"] > 0.5
    assert "--fix" in accepted["said"]
    assert "empty" in nothing["said"]
    assert "no triangle" in strips["said"]
