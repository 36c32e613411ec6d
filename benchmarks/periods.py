"""Lateness of the 1 kHz haptic loop, period by period: alone, and with other work beside it.

    python benchmarks/periods.py [--seconds 10] [--load N] [--json FILE]

The real loop with a simulated hand and patches at 60 Hz runs in its own process, once as the
machine is and once beside N programs at ordinary priority that never rest and move memory about
(one for each processor if N is not given). A period's lateness is from the moment it was due to its
start; of those that a late one leaves out each counts as late as it would have begun, as figures
without them would hide a stall. The first half second is left out. It says whether the system
granted real time: without it the second line is the scheduler's and not the loop's.
"""

from __future__ import annotations

import contextlib
import math
import os
import subprocess
import sys
import time
from collections.abc import Generator, Sequence
from dataclasses import replace

import json_report
from cohaptic.clock import SystemClock
from cohaptic.status.row import rows_in
from cohaptic_client.loop.handle import HapticProcess
from cohaptic_client.loop.memory import LoopMemory
from cohaptic_client.loop.running.haptic_loop import WARM_UP
from cohaptic_client.news import is_real_time
from loop import TICK, config, patch

HZ = 1000.0
# us; a tenth of a period is nothing, one of them a force that is as old again, 20 a fault
EDGES = (10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 20_000)
QUANTILES = {"late_p50_s": 0.5, "late_p99_s": 0.99, "late_p999_s": 0.999, "late_worst_s": 1.0}
_WORK = "data = bytearray(1 << 24)\nwhile True:\n    data = data.copy()"


def with_those_left_out(late: Sequence[float], period: float) -> list[float]:
    """Lateness of every period that was due, in ascending order [s].

    Args:
        late: Lateness of those that were begun [s].
        period: Between two that are due [s].
    """
    return sorted(
        each - k * period
        for each in late
        for k in range(1 + (int(each / period) if each > 0.0 else 0))
    )


def quantile(ordered: Sequence[float], q: float) -> float:
    """Least value which a share `q` of the values does not exceed; of at least one value.

    Args:
        ordered: In ascending order.
        q: 0 to 1.
    """
    return ordered[max(0, math.ceil(q * len(ordered)) - 1)]


def histogram(late: Sequence[float]) -> dict[str, int]:
    """Number of periods between two of `EDGES`, by the upper one in microseconds.

    Args:
        late: Lateness of each period [s].
    """
    names = [f"to_{edge}_us" for edge in EDGES]
    counts = dict.fromkeys([*names, "above"], 0)
    for each in late:
        name = next((n for n, e in zip(names, EDGES, strict=True) if each <= 1e-6 * e), "above")
        counts[name] += 1
    return counts


def run(seconds: float) -> tuple[list[float], str]:
    """Lateness of each period of the loop over some time [s], and how it was scheduled."""
    clock, memory = SystemClock(), LoopMemory.create()
    process = HapticProcess(replace(config(HZ, clock, memory), every_row=True), memory)
    late, begins = list[float](), math.inf
    for tick in range(1, round((2.0 + WARM_UP + seconds) / TICK)):
        process.give_patch(patch(tick))
        process.beat()
        for row in rows_in(process.new_rows()):
            begins = min(begins, row.t + WARM_UP)
            if begins <= row.t < begins + seconds:
                late.append(row.late)
        time.sleep(TICK)
    process.request_stop()
    process.wait()
    process.read_status()
    memory.close(remove=True)
    if not late:
        raise SystemExit("the loop has begun no period; is the machine out of memory?")
    return late, str(process.status.get("scheduling", ""))


@contextlib.contextmanager
def work_beside(programs: int) -> Generator[None]:
    """So many programs that never rest, until the end of the context."""
    started = [subprocess.Popen([sys.executable, "-c", _WORK]) for _ in range(programs)]
    try:
        yield
    finally:
        for each in started:
            each.kill()
            each.wait()


def main() -> None:
    """Print a table and two histograms."""
    parser = json_report.parser(__doc__)
    parser.add_argument("--seconds", type=float, default=10.0, help="of the loop, each time")
    parser.add_argument("--load", type=int, default=os.cpu_count() or 1, help="programs beside it")
    options = parser.parse_args()
    if not 0.1 <= options.seconds <= 3600.0:
        parser.error(f"--seconds is {options.seconds:g}; it must be from 0.1 to 3600")
    if not 0 <= options.load <= 1000:
        parser.error(f"--load is {options.load}; it must be from 0 to 1000")
    results: list[json_report.Result] = []
    counted: list[dict[str, int]] = []
    print("| beside it | real time | periods | p50 | p99 | p99.9 | worst |")
    print("|---|---|---|---|---|---|---|")
    for programs in (0, options.load):
        with work_beside(programs):
            begun, scheduling = run(options.seconds)
        late = with_those_left_out(begun, 1.0 / HZ)
        figures = {name: quantile(late, q) for name, q in QUANTILES.items()}
        granted = is_real_time(scheduling)
        counted.append(histogram(late))
        results.append(
            {"load": programs, "real_time": granted, "scheduling": scheduling}
            | {"periods": len(late), "left_out": len(late) - len(begun), "rate_hz": HZ}
            | figures | counted[-1]
        )  # fmt: skip
        times = " | ".join(f"{1e6 * value:.0f} us" for value in figures.values())
        words = "granted" if granted else "refused"
        print(f"| {programs} programs | {words} ({scheduling}) | {len(late)} | {times} |")
    print("\n| late by | alone | with load |\n|---|---|---|")
    for name in counted[0]:
        fractions = " | ".join(f"{100.0 * c[name] / sum(c.values()):.3f} %" for c in counted)
        print(f"| {name.replace('_', ' ')} | {fractions} |")
    json_report.write(options, results)


if __name__ == "__main__":
    main()
