"""What a machine's scheduler can do: loops that only sleep, to lay beside the haptic loop.

`cyclictest` (Debian: rt-tests) as it is usually run, which keeps the processors from idling, and
with the machine left as it is; and an empty loop in C, compiled here. All of them at the scheduling
priority that they are given. What is not installed is None.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

from cohaptic.status.quantiles import Tally

LONGEST = 100_000  # us; a histogram's last bucket

# Lateness of each wake-up as a histogram in microseconds, and the processor time of the whole.
EMPTY_LOOP = """
#define _GNU_SOURCE
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <time.h>
#define LONGEST 100000
static long histogram[LONGEST + 1];
static double cpu(void) {
  struct rusage u;
  getrusage(RUSAGE_SELF, &u);
  return u.ru_utime.tv_sec + u.ru_stime.tv_sec + 1e-6 * (u.ru_utime.tv_usec + u.ru_stime.tv_usec);
}
int main(int argc, char **argv) {
  long period = atol(argv[1]), loops = atol(argv[2]);
  struct sched_param p = {.sched_priority = atoi(argv[3])};
  struct timespec due, now, begin;
  mlockall(MCL_CURRENT | MCL_FUTURE);
  prctl(PR_SET_TIMERSLACK, 1);
  if (p.sched_priority && sched_setscheduler(0, SCHED_FIFO, &p)) return 1;
  clock_gettime(CLOCK_MONOTONIC, &due);
  begin = due;
  double before = cpu();
  for (long i = 0; i < loops; i++) {
    due.tv_nsec += period;
    if (due.tv_nsec >= 1000000000) { due.tv_nsec -= 1000000000; due.tv_sec++; }
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, 0);
    clock_gettime(CLOCK_MONOTONIC, &now);
    long late = (now.tv_sec - due.tv_sec) * 1000000 + (now.tv_nsec - due.tv_nsec) / 1000;
    histogram[late < 0 ? 0 : late > LONGEST ? LONGEST : late]++;
  }
  double took = now.tv_sec - begin.tv_sec + 1e-9 * (now.tv_nsec - begin.tv_nsec);
  printf("cpu %f\\n", (cpu() - before) / took);
  for (long i = 0; i <= LONGEST; i++)
    if (histogram[i]) printf("%ld %ld\\n", i, histogram[i]);
  return 0;
}
"""


@dataclass(frozen=True, slots=True)
class Wakeups:
    """How punctual a loop that only sleeps was.

    Args:
        late: Lateness of each wake-up [s].
        missed: Share of wake-ups that were late by more than a period.
        cpu: Share of a core; None if unknown.
    """

    late: Tally
    missed: float
    cpu: float | None


def cyclictest(hz: float, seconds: float, priority: int, *, awake: bool) -> Wakeups | None:
    """Run cyclictest; None where it is not installed or fails.

    Args:
        hz: Wake-ups per second.
        seconds: How long.
        priority: Real-time priority; 0 for an ordinary process.
        awake: Whether it may keep the processors from idling, as it does by itself.
    """
    program = shutil.which("cyclictest")
    if program is None:
        return None
    command = [program, "-q", "-m", "-i", f"{1e6 / hz:.0f}", "-l", f"{seconds * hz:.0f}"]
    command += ["-h", str(LONGEST)]
    command += ["-p", str(priority)] if priority else ["--policy=other"]
    return _run(command if awake else [*command, "--default-system"], 1e6 / hz)


class EmptyLoop:
    """An empty loop in C, compiled for as long as this is open."""

    def __init__(self) -> None:
        self._folder = tempfile.TemporaryDirectory()
        self._program: str | None = None
        compiler = shutil.which("cc")
        if compiler is not None:
            source = Path(self._folder.name, "empty.c")
            source.write_text(EMPTY_LOOP)
            program = str(source.with_suffix(""))
            done = subprocess.run([compiler, "-O2", "-o", program, str(source)], check=False)
            self._program = program if done.returncode == 0 else None

    def run(self, hz: float, seconds: float, priority: int) -> Wakeups | None:
        """Run it, at a real-time priority or 0; None where it could not be compiled."""
        if self._program is None:
            return None
        numbers = (f"{1e9 / hz:.0f}", f"{seconds * hz:.0f}", str(priority))
        return _run([self._program, *numbers], 1e6 / hz)

    def close(self) -> None:
        """Delete it."""
        self._folder.cleanup()


def _run(command: list[str], period: float) -> Wakeups | None:
    """Run a program that prints a histogram: microseconds and how often, line by line.

    Args:
        command: The program.
        period: Between wake-ups [us].
    """
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        return None
    late, missed = Tally(), 0
    for microseconds, count in re.findall(r"^(\d+) (\d+)$", done.stdout, re.M):
        for _ in range(int(count)):
            late.add(1e-6 * (int(microseconds) + 0.5))
        missed += int(count) if int(microseconds) > period else 0
    cpu = re.search(r"^cpu ([\d.]+)$", done.stdout, re.M)
    fraction = missed / max(1, late.count)
    return Wakeups(late, fraction, float(cpu[1]) if cpu else None)
