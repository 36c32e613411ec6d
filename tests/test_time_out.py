"""A law that stands still ends as one that timed out, on its first example."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.live
ROOT = Path(__file__).parents[1]
LAW = """\
import time

from hypothesis import given, strategies as st


@given(st.integers())
def test_law(number: int) -> None:
    with open({tries!r}, "a") as tries:
        tries.write("x")
    time.sleep(1000.0)
"""


SLOW_END = """\
import time

import pytest


@pytest.fixture
def slow():
    yield
    time.sleep(1000.0)


def test_slow(slow):
    pass
"""


def run(folder: Path) -> str:
    """What pytest says of the tests in a folder."""
    (folder / "conftest.py").write_text(
        "from tests.time_out import pytest_timeout_set_timer\n", encoding="utf-8"
    )
    ended = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--timeout", "1", folder],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 1, ended.stdout + ended.stderr
    return ended.stdout


def test_hypothesis_looks_for_no_smaller_example_of_a_time_out(tmp_path: Path) -> None:
    tries = tmp_path / "tries"
    (tmp_path / "test_law.py").write_text(LAW.format(tries=str(tries)), encoding="utf-8")
    assert "TimedOut: test_law.py::test_law took longer than 1 s" in run(tmp_path)
    assert tries.read_text(encoding="utf-8") == "x"


def test_a_fixture_that_does_not_end_is_no_fault_of_the_next_test(tmp_path: Path) -> None:
    (tmp_path / "test_a.py").write_text(SLOW_END, encoding="utf-8")
    (tmp_path / "test_b.py").write_text("def test_b():\n    pass\n", encoding="utf-8")
    said = run(tmp_path)
    assert "TimedOut: test_a.py::test_slow took longer than 1 s" in said
    assert "2 passed, 1 error" in said
