from __future__ import annotations

import subprocess
import sys

import pytest

from cohaptic_server.peak_memory import own_peak, peak_memory

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="it says no peak of memory")

SIZE = 400_000_000  # bytes
PEAK = "from cohaptic_server.peak_memory import peak_memory; print(peak_memory())"
LARGE = f"""
import subprocess, sys
room = bytearray({SIZE})
room[::4096] = b"x" * len(room[::4096])
sys.exit(subprocess.run([sys.executable, "-c", {PEAK!r}]).returncode)
"""


def test_what_was_given_back_counts() -> None:
    room = bytearray(SIZE)
    room[::4096] = b"x" * len(room[::4096])
    del room
    assert peak_memory() >= own_peak() > SIZE


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere the system counts each by itself")
def test_the_memory_of_the_program_that_started_it_does_not() -> None:
    done = subprocess.run([sys.executable, "-c", LARGE], capture_output=True, text=True, check=True)
    assert float(done.stdout) < 0.5 * SIZE
