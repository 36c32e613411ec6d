"""Every phase of a tier runs, and what failed in any of them is said at the end."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from itertools import product
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import suite
from suite import NO_TESTS, TIERS, Outcome, Phase

PHASES = [Phase(name, name) for name in ("first", "second", "third")]
TESTS = st.sets(st.sampled_from(["a::b", "a::c", "d::e"]))


@given(st.lists(st.sampled_from([0, 1, NO_TESTS]), min_size=3, max_size=3))
def test_a_failure_hides_no_later_phase(states: list[int]) -> None:
    ran: list[str] = []

    def one(phase: Phase, _arguments: Sequence[str]) -> Outcome:
        ran.append(phase.name)
        return Outcome(phase.name, states[len(ran) - 1], {}, {})

    outcomes = suite.run_tier(PHASES, (), one)
    assert ran == [phase.name for phase in PHASES]
    assert suite.status_of(outcomes) == (0 if states == [0, 0, 0] else 1)
    # Where arguments chose tests, some phases have none of them.
    assert suite.status_of(outcomes, a_part=True) == (0 if 1 not in states and 0 in states else 1)


def test_every_night_tries_laws_on_new_examples_and_no_mark_is_in_no_tier() -> None:
    assert any(phase.hypothesis == "deep" and "not (" in phase.marks for phase in TIERS["night"])
    marks = " or ".join(phase.marks for tier in ("all", "night") for phase in TIERS[tier])
    names = ("live", "alone", "smoke", "night")
    for chosen in product((False, True), repeat=len(names)):
        assert eval(marks, dict(zip(names, chosen, strict=True))), chosen


@given(TESTS, TESTS)
def test_flaky_is_what_was_run_again_and_passed(failed: set[str], again: set[str]) -> None:
    lines = [json.dumps([test, "rerun", "why"]) for test in again]
    lines += [json.dumps([test, "failed", "why"]) for test in failed]
    outcome = suite.read("live", 1 if failed else 0, lines)
    assert (set(outcome.failed), set(outcome.flaky)) == (failed, again - failed)
    said = suite.summary([outcome])
    assert sum(line.startswith("FAILED") for line in said) == len(failed)
    assert sum(line.startswith("FLAKY") for line in said) == len(again - failed)


FAILS_ONCE = """
from collections.abc import Sequence
from pathlib import Path
import pytest

@pytest.mark.smoke
@pytest.mark.live
def test_second_time():
    seen = Path(__file__).with_name("seen")
    first = not seen.exists()
    seen.touch()
    assert not first

def wait():
    assert False

def test_wrong():
    wait()

@pytest.mark.night
def test_long():
    assert False
"""


@pytest.mark.live
def test_phases_of_a_real_run(tmp_path: Path) -> None:
    """A law that fails, and a live test that passes when it is run again."""
    file = tmp_path / "test_two.py"
    file.write_text(FAILS_ONCE)
    done = subprocess.run(
        [sys.executable, suite.__file__, "test", str(file)],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "JOBS": "1"},
    )
    *_, flaky, failed, verdict = done.stdout.strip().splitlines()
    assert done.returncode == 1
    assert flaky.startswith("FLAKY ")
    assert "test_second_time   (live smoke: test_two.py:12: assert not True)" in flaky
    assert failed.startswith("FAILED ")
    assert "test_wrong   (laws, in virtual time: test_two.py:18: assert False)" in failed
    assert verdict == "1 tests failed, 1 were tried again"
