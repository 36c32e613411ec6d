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


def test_hypothesis_looks_for_no_smaller_example_of_a_time_out(tmp_path: Path) -> None:
    tries, law = tmp_path / "tries", tmp_path / "test_law.py"
    law.write_text(LAW.format(tries=str(tries)), encoding="utf-8")
    (tmp_path / "conftest.py").write_text(
        "from tests.time_out import pytest_timeout_set_timer\n", encoding="utf-8"
    )
    ended = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--timeout", "1", law],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 1, ended.stdout + ended.stderr
    assert "TimedOut: test_law.py::test_law took longer than 1 s" in ended.stdout
    assert tries.read_text(encoding="utf-8") == "x"
