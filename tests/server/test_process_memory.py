from __future__ import annotations

import subprocess
import sys

import pytest

pytestmark = [
    pytest.mark.live,
    pytest.mark.skipif(sys.platform == "win32", reason="it says no peak of memory"),
]

SIZE = 400_000_000  # bytes
PEAK = "from cohaptic_server.process_memory import peak_memory; print(peak_memory())"
LARGE = f"""
import subprocess, sys
room = bytearray({SIZE})
room[::4096] = b"x" * len(room[::4096])
sys.exit(subprocess.run([sys.executable, "-c", {PEAK!r}]).returncode)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere the system counts each by itself")
def test_the_memory_of_the_program_that_started_it_does_not() -> None:
    done = subprocess.run([sys.executable, "-c", LARGE], capture_output=True, text=True, check=True)
    assert float(done.stdout) < 0.5 * SIZE


GARBAGE = """
import re
from pathlib import Path
import numpy as np
from cohaptic_server.bodies.solid.parts import factor_of
from cohaptic_server.bodies.solid.shape import SolidSettings, shape_of
from cohaptic_server.testing.blocks import block

def taken():
    return 1024 * int(re.search(r"VmRSS:\\s*(\\d+)", Path("/proc/self/status").read_text())[1])

pieces = [np.ones(10_000) for _ in range(4_000)]
full = taken()
last = pieces.pop()
del pieces
kept = taken()
mesh = block((0.1, 0.1, 0.1), (2, 2, 2))
factor_of(shape_of(mesh, mesh.vertices[:, 2] < 0.01, SolidSettings(order=1)))
print(full, kept, taken())
"""


@pytest.mark.skipif(sys.platform != "linux", reason="as glibc keeps what is let go")
def test_a_factorisation_begins_without_what_was_let_go_before() -> None:
    done = subprocess.run(
        [sys.executable, "-c", GARBAGE], capture_output=True, text=True, check=True
    )
    full, kept, factored = (int(word) for word in done.stdout.split())
    if kept < full - 10**8:
        pytest.skip("this C library keeps nothing")
    assert factored < full - 2.5 * 10**8
