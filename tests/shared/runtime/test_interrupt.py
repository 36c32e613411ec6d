"""A process that is told to end, more than once, puts its things in order all the same."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = [
    pytest.mark.patient,
    pytest.mark.skipif(sys.platform == "win32", reason="needs POSIX signals"),
]

# Each line of its output is a signal that the test sends; the clean-up takes three rounds.
WORK = """
import asyncio, os, sys
from cohaptic.runtime.interrupt import run

async def work():
    try:
        print("works", flush=True)
        await asyncio.Event().wait()
    finally:
        for _ in range(3):
            print("cleans up", flush=True)
            await asyncio.to_thread(sys.stdin.readline)
        os.unlink(sys.argv[1])

run(work())
print("ends", flush=True)
sys.stdin.readline()
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_second_interrupt_does_not_cut_the_clean_up_short(tmp_path: Path, number: int) -> None:
    shared = tmp_path / "shared"
    shared.touch()
    process = subprocess.Popen(
        [sys.executable, "-c", WORK, str(shared)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdin is not None
    assert process.stdout is not None
    said: list[str] = []
    while line := process.stdout.readline():
        said.append(line.strip())
        os.kill(process.pid, number)
        if said[-1] != "works":
            process.stdin.write("\n")
            process.stdin.flush()
    _, errors = process.communicate(timeout=30)
    assert said == ["works", "cleans up", "cleans up", "cleans up", "ends"]
    assert not shared.exists()
    assert (process.returncode, errors) == (0, "")
