"""The soak and the fuzz of `benchmarks/`, for as long as a suite of tests can wait.

`COHAPTIC_SOAK_MINUTES=3` lets the soak take three minutes, as `make soak` does.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from soak import growth

pytestmark = [pytest.mark.alone, pytest.mark.night]
ROOT = Path(__file__).parents[2]
MINUTES = os.environ.get("COHAPTIC_SOAK_MINUTES")
# In so short a time little would happen at the pace of the long one.
PACE = ("--minutes", "0.1", "--step", "0.15") if MINUTES is None else ("--minutes", MINUTES)
ALL_KINDS = "joins hostile stalls laws watched rooms_killed clients_killed"


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, *arguments]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_a_server_under_all_that_happens_keeps_its_rooms_its_memory_and_no_ghost() -> None:
    done = run("benchmarks/soak.py", *PACE, "--seed", "7")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "nothing was wrong" in done.stdout
    figures = dict(line.split() for line in done.stdout.splitlines() if line.count(" ") == 1)
    assert not [kind for kind in ALL_KINDS.split() if float(figures[kind]) < 1.0], done.stdout


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_frames_of_rubbish_change_no_number_of_anothers_patches() -> None:
    done = run("benchmarks/fuzz.py", "--frames", "8000", "--connections", "80")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "patches_that_differ 0" in done.stdout


def test_memory_that_grows_is_found() -> None:
    flat = [{"a": 100 + k % 3} for k in range(12)]
    assert abs(growth(flat)["a"]) < 0.03
    assert growth([{"a": 100 + k} for k in range(12)])["a"] > 0.05
