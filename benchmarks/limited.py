"""Runs a command within limits of time and memory, and measures both.

Where there is `/proc` the memory is the largest resident one of the command and of each process
that it starts, summed ten times a second; pages that two of them share count twice. Elsewhere it is
the largest process's, known at the end, and the limit is judged then; on Windows it is not known.
"""

from __future__ import annotations

import math
import os
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

_EVERY = 0.1  # s between two looks


@dataclass(frozen=True, slots=True)
class Ended:
    """How a command ended.

    Args:
        code: Its exit status; negative for a signal.
        seconds: How long it took [s].
        processor: Processor time of it and of what it waited for [s]; NaN if it is not known.
        memory: Its largest resident memory [bytes]; NaN if it is not known.
        over: The limit at which it was stopped, in words; empty if it ended by itself.
        out: Its standard output.
        err: Its standard error.
    """

    code: int
    seconds: float
    processor: float
    memory: float
    over: str
    out: str
    err: str


def run_limited(
    command: Sequence[str],
    *,
    seconds: float,
    memory: float,
    env: Mapping[str, str],
    ends: threading.Event | None = None,
) -> Ended:
    """Run a command to its end, or to one of its limits.

    Args:
        command: Program and arguments.
        seconds: Longest time [s].
        memory: Largest resident memory [bytes].
        env: Added to this process's environment.
        ends: Set by another thread when whoever asked wants no more of it.
    """
    begin, peak, over = time.perf_counter(), math.nan, ""
    with tempfile.TemporaryFile("w+b") as out, tempfile.TemporaryFile("w+b") as err:
        # In a session of its own, so that its children are known by it and end with it.
        process = subprocess.Popen(
            command, stdout=out, stderr=err, env=os.environ | env, start_new_session=True
        )
        try:
            while (used := _ended(process)) is None:
                spent, now = time.perf_counter() - begin, _resident(process.pid)
                peak = now if math.isnan(peak) else max(peak, now)
                if spent > seconds:
                    over = f"stopped after {seconds:g} s"
                elif peak > memory:
                    over = f"stopped at {memory / 1e9:.3g} GB of memory"
                elif ends is not None and ends.is_set():
                    over = "stopped with the rest"
                if over:
                    used = _stop(process)
                    break
                time.sleep(_EVERY)
        except BaseException:
            _stop(process)
            raise
        took = time.perf_counter() - begin
        processor, largest = used
        if math.isnan(peak):
            peak = largest
            over = f"took {peak / 1e9:.3g} GB of memory" if peak > memory else ""
        texts: list[str] = []
        for file in (out, err):
            file.seek(0)
            texts.append(file.read().decode(errors="replace"))
    return Ended(process.returncode, took, processor, peak, over, *texts)


def _ended(process: subprocess.Popen[bytes], *, wait: bool = False) -> tuple[float, float] | None:
    """Processor time [s] and largest memory [bytes] of a process that ended; None while it runs."""
    if sys.platform == "win32":
        return None if not wait and process.poll() is None else (math.nan, math.nan)
    found, status, usage = os.wait4(process.pid, 0 if wait else os.WNOHANG)
    if not found:
        return None
    process.returncode = os.waitstatus_to_exitcode(status)
    largest = usage.ru_maxrss * (1 if sys.platform == "darwin" else 1024)
    return usage.ru_utime + usage.ru_stime, float(largest)


def _resident(session: int) -> float:
    """Largest resident memory of each process of a session, summed [bytes]; NaN without `/proc`.

    What `wait4` says of a child on Linux is no less than what its parent had when it started it.
    """
    if sys.platform != "linux":
        return math.nan
    kilobytes = 0
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                # The name in brackets may have blanks; state, parent, group and session follow.
                fields = (entry / "stat").read_text().rpartition(")")[2].split()
                status = (entry / "status").read_text() if int(fields[3]) == session else ""
            except OSError:  # it has ended meanwhile
                continue
            peak = re.search(r"^VmHWM:\s+(\d+) kB", status, re.M)
            kilobytes += int(peak[1]) if peak else 0
    return 1024.0 * kilobytes


def _stop(process: subprocess.Popen[bytes]) -> tuple[float, float]:
    """End a process and those that it started; what it used."""
    if sys.platform == "win32":
        process.kill()
        process.wait()
    else:
        os.killpg(process.pid, signal.SIGKILL)
    return _ended(process, wait=True) or (math.nan, math.nan)
