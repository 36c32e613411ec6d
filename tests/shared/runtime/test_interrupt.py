"""A process that is told to end, more than once, puts its things in order all the same."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.patience import PATIENCE

pytestmark = [
    pytest.mark.live,
    pytest.mark.usefixtures("terminal"),
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


# Names, as Windows lacks one of them.
@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_a_second_interrupt_does_not_cut_the_clean_up_short(tmp_path: Path, name: str) -> None:
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
    try:
        while line := process.stdout.readline():
            said.append(line.strip())
            os.kill(process.pid, getattr(signal, name))
            if said[-1] != "works":
                process.stdin.write("\n")
                process.stdin.flush()
        _, errors = process.communicate(timeout=PATIENCE)
    finally:
        process.kill()
        process.communicate()
    assert said == ["works", "cleans up", "cleans up", "cleans up", "ends"]
    assert not shared.exists()
    assert (process.returncode, errors) == (0, "")


# Another thread takes the signals, so that none interrupts the wait of the loop: as if each came
# just before it began.
IDLE = """
import asyncio, functools, signal, threading
from cohaptic.runtime.interrupt import run

async def work():
    threading.Thread(target=threading.Event().wait, daemon=True).start()
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM, signal.SIGHUP})
    asyncio.get_running_loop().call_soon(functools.partial(print, "waits", flush=True))
    await asyncio.Event().wait()

run(work())
"""


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_a_loop_without_events_hears_of_a_signal_that_did_not_interrupt_its_wait(name: str) -> None:
    process = subprocess.Popen([sys.executable, "-c", IDLE], stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None
        assert process.stdout.readline() == "waits\n"
        os.kill(process.pid, getattr(signal, name))
        assert process.communicate(timeout=PATIENCE)[0] == ""
        assert process.returncode == 0
    finally:
        process.kill()
        process.communicate()


# A mask of one thread leaves a signal to another, for which there must be a handler all the time.
HANDLERS = """
import asyncio, signal
from cohaptic.runtime.interrupt import run

install, names = signal.signal, ("SIGINT", "SIGTERM", "SIGHUP")

def noted(number, handler):
    ends = handler in (signal.SIG_DFL, signal.default_int_handler)
    if begun and ends and signal.Signals(number).name in names:
        print("ends by", signal.Signals(number).name)
    return install(number, handler)

begun = False
signal.signal = noted

async def work():
    global begun
    begun = True

run(work())
"""


def test_no_signal_ends_the_process_from_the_work_on_until_its_end() -> None:
    done = subprocess.run(
        [sys.executable, "-c", HANDLERS],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=True,
    )
    assert (done.stdout, done.stderr) == ("", "")


IGNORES = """
import signal
from cohaptic.runtime.interrupt import run

async def work():
    print(signal.getsignal(signal.SIGHUP) == signal.SIG_IGN)

signal.signal(signal.SIGHUP, signal.SIG_IGN)  # as nohup starts a program
run(work())
"""


def test_under_nohup_a_terminal_that_closes_interrupts_nothing() -> None:
    done = subprocess.run(
        [sys.executable, "-c", IGNORES],
        capture_output=True,
        text=True,
        check=True,
        timeout=PATIENCE,
    )
    assert done.stdout == "True\n"
