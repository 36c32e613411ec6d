"""A command is stopped at its limits, and what it used is known."""

from __future__ import annotations

import sys
import threading

import pytest

from limited import Ended, run_limited

pytestmark = pytest.mark.live


def run(
    code: str, *, seconds: float = 60.0, memory: float = 1e10, ends: threading.Event | None = None
) -> Ended:
    command = [sys.executable, "-c", code]
    return run_limited(command, seconds=seconds, memory=memory, env={"NIGHT": "yes"}, ends=ends)


def test_one_that_takes_too_long_is_stopped() -> None:
    ended = run("print('begun', flush=True)\nwhile True: pass", seconds=4.0)
    assert ended.over == "stopped after 4 s"
    assert ended.code != 0
    assert ended.out == "begun\n"


@pytest.mark.skipif(sys.platform != "linux", reason="memory is known at the end only")
def test_one_whose_child_takes_too_much_memory_is_stopped() -> None:
    child = "x = b'1' * 300_000_000\nwhile True: pass"
    parent = f"import subprocess, sys; subprocess.run([sys.executable, '-c', {child!r}])"
    ended = run(parent, memory=2e8)
    assert ended.over == "stopped at 0.2 GB of memory"
    assert ended.code != 0
