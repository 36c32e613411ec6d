"""The nightly script says of each file what became of it: a short run, and its judgements."""

from __future__ import annotations

from typing import Any

import pytest

import many_objects
from limited import Ended

pytestmark = pytest.mark.live

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
