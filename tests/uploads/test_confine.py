"""The limits hold against a process that does not want them."""

from __future__ import annotations

import subprocess
import sys

import pytest

from cohaptic_uploads.confine import TOO_MUCH_MEMORY

pytestmark = pytest.mark.live

LINUX = pytest.mark.skipif(sys.platform != "linux", reason="as Linux does it")
START = "from cohaptic_uploads.confine import confine, watch\n"


def run(code: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", START + code], capture_output=True, text=True, check=False
    )


@LINUX
def test_an_allocation_beyond_the_limit_fails() -> None:
    code = "confine(300_000_000, 10, 1000)\ntry: bytearray(400_000_000)\n"
    assert run(code + "except MemoryError: print('no')").stdout == "no\n"


@LINUX
def test_an_endless_loop_ends() -> None:
    assert run("confine(300_000_000, 1, 1000)\nwhile True: pass").returncode == -24


@pytest.mark.skipif(sys.platform == "win32", reason="as POSIX does it")
def test_no_large_file_is_written() -> None:
    code = (
        "import os, tempfile\nconfine(3_000_000_000, 10, 1000)\nf, _ = tempfile.mkstemp()\n"
        "print(os.write(f, bytes(5000)))\n"
        "try: os.write(f, b'1')\nexcept OSError as e: print(e.strerror)\n"
    )
    assert run(code).stdout == "1000\nFile too large\n"


def test_the_thread_ends_a_process_above_its_limit() -> None:
    code = (
        "import threading, time\nthreading.Thread(target=watch, args=(200_000_000,)).start()\n"
        "kept = bytearray(b'1' * 300_000_000)\nthreading.Event().wait(20)\n"
    )
    assert run(code).returncode == TOO_MUCH_MEMORY
