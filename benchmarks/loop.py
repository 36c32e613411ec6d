"""Lateness of the haptic loop, the cost of a period, and the processor time of a whole client.

    python benchmarks/loop.py [--seconds 3] [--rounds 5] [--json FILE]

The real loop with a simulated hand runs in its own process at 1 and 4 kHz, beside loops that only
sleep, at the same scheduling priority and in turn, round by round: `cyclictest` with the machine as
it is, `cyclictest` as it is usually run (it keeps the processors from idling, which the haptic loop
does not), and an empty loop in C. *Ratio* is the p99 of the haptic loop over theirs, *missed* the
share of periods left out or, of the others, begun more than a period late. Then `cohaptic touch`
runs against a server of its own on loopback. The first half second of a loop is left out of
lateness and cost (`warm_up`), the first three seconds out of the processor time of a client. Each
figure is the median over the rounds; timings depend on the machine and its load, so compare within
one run.
"""

from __future__ import annotations

import math
import os
import socket
import statistics
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import json_report
from cohaptic.clock import SystemClock
from cohaptic.control.law import Law
from cohaptic.control.laws.model import LawSettings
from cohaptic.protocol.patch import Geometry, Patch
from cohaptic.runtime.scheduling import LOOP_PRIORITY
from cohaptic.simulated.hand import Hand, HandScript, Rhythm
from cohaptic_client.devices.kind import DeviceChoice, DeviceConfig
from cohaptic_client.loop.config import LoopConfig, silent_after
from cohaptic_client.loop.handle import HapticProcess
from cohaptic_client.loop.memory import LoopMemory
from cohaptic_client.loop.passivity import MAX_DAMPING
from cohaptic_client.loop.running.haptic_loop import WARM_UP
from cohaptic_client.loop.safety import SafetyLimits
from wakeups import EmptyLoop, Wakeups, cyclictest

TICK = 1.0 / 60.0  # s
STARTED = 3.0  # s until a client touches
Figures = dict[str, float | None]


def config(hz: float, clock: SystemClock, memory: LoopMemory) -> LoopConfig:
    """A hand that presses and releases on a plane."""
    script = HandScript(angle=0.0, depth=0.01, rhythm=Rhythm(1.0))
    return LoopConfig(
        memory=memory.path,
        clock_origin=clock.origin,
        haptic_period=1.0 / hz,
        simulation_period=TICK,
        law=LawSettings(),
        smoothing=1.0,
        max_damping=MAX_DAMPING,
        friction=0.0,
        follow=True,
        device=DeviceConfig(
            DeviceChoice("simulated"),
            (0.0, 0.0, 0.0),
            0.1,
            Hand(),
            script.intention((0.0, 0.0, 0.0), 0.1),
        ),
        limits=SafetyLimits(silent_after=silent_after(TICK)),
        every_row=False,
    )


def patch(tick: int) -> bytes:
    """A plane that moves a little from tick to tick."""
    lift = 0.002 * math.sin(0.1 * tick)
    return Patch(
        tick=tick, seq=0, t_server=0.0, t_client=0.0, sample_wait=0.0, geometry=Geometry.PLANE,
        law=Law.PREDICTIVE,
        x_free=(0.1 + lift, 0.0, 0.0), normal=(1.0, 0.0, 0.0), curvature=0.0,
        c_ii=0.004, k_h=250.0, integral_gain=0.0, own_force=(0.0, 0.0, 0.0),
        u_others=(lift, 0.0, 0.0),
    ).encode()  # fmt: skip


def cpu_time(pid: int) -> float | None:
    """Processor time of all threads of a process [s]; None where the system does not tell."""
    try:
        tasks = list(Path(f"/proc/{pid}/task").iterdir())
        return 1e-9 * sum(int((task / "schedstat").read_text().split()[0]) for task in tasks)
    except (OSError, ValueError, IndexError):
        return None


def children(pid: int) -> list[int]:
    """Numbers of the processes that a process has started; empty where the system does not tell."""
    try:
        return [int(n) for n in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]
    except (OSError, ValueError):
        return []


def cpu_fractions(pids: Sequence[int], seconds: float) -> list[float | None]:
    """Share of a core that each process takes over the next seconds."""
    start = time.perf_counter()
    before = [cpu_time(pid) for pid in pids]
    time.sleep(seconds)
    after, took = [cpu_time(pid) for pid in pids], time.perf_counter() - start
    return [
        None if a is None or b is None else (b - a) / took
        for a, b in zip(before, after, strict=True)
    ]


def haptic_loop(hz: float, seconds: float) -> tuple[Figures, str]:
    """The loop as in the product, with patches at 60 Hz; its figures, and its scheduling."""
    clock, memory = SystemClock(), LoopMemory.create()
    frames = [patch(tick) for tick in range(1, round((WARM_UP + seconds + 1.0) / TICK))]
    process = HapticProcess(config(hz, clock, memory), memory)
    (pid,) = children(os.getpid()) or [0]
    before, start, counted = None, 0.0, clock.now()
    for frame in frames:
        process.give_patch(frame)
        process.beat()
        if before is None and clock.now() - counted > WARM_UP + 0.5:
            before, start = cpu_time(pid), time.perf_counter()
        time.sleep(TICK)
    after, end = cpu_time(pid), time.perf_counter()
    process.request_stop()
    process.wait()
    process.read_status()
    memory.close(remove=True)
    seen = process.status
    figures: Figures = {
        f"{name}_s": float(str(seen[name]))
        for name in ("late_p50", "late_p99", "cost_p50", "cost_p99")
    }
    figures["missed"] = float(str(seen["missed"])) / (hz * seconds)
    figures["cpu"] = None if before is None or after is None else (after - before) / (end - start)
    return figures, str(seen["scheduling"])


def of_wakeups(seen: Wakeups | None) -> Figures:
    """Figures of a loop that only sleeps; all None where it could not run."""
    if seen is None:
        return {"late_p50_s": None, "late_p99_s": None, "missed": None, "cpu": None}
    return {
        "late_p50_s": seen.late.quantile(0.5),
        "late_p99_s": seen.late.quantile(0.99),
        "missed": seen.missed,
        "cpu": seen.cpu,
    }


def touch(geometry: str, seconds: float) -> Figures:
    """`cohaptic touch` at a server on loopback: share of a core of each of its processes."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    quiet = subprocess.DEVNULL
    program = [sys.executable, "-m", "cohaptic"]
    server = subprocess.Popen(
        [*program, "serve", "--port", str(port)], stdout=quiet, stderr=quiet, stdin=quiet
    )
    options = ["--geometry", geometry, "--rhythm-s", "1", "--depth-mm", "10", "--wait", "30"]
    client = subprocess.Popen(
        [*program, "touch", f"ws://127.0.0.1:{port}", *options],
        stdout=quiet, stderr=quiet, stdin=quiet,
    )  # fmt: skip
    try:
        deadline = time.perf_counter() + 30.0
        while not children(client.pid) and time.perf_counter() < deadline:
            time.sleep(0.1)
        time.sleep(STARTED)
        network, loop = cpu_fractions([client.pid, *(children(client.pid) or [0])][:2], seconds)
    finally:
        client.terminate()
        client.wait()
        server.terminate()
        server.wait()
    both = None if network is None or loop is None else network + loop
    return {"cpu": both, "network_cpu": network, "loop_cpu": loop}


def median(rounds: Sequence[Figures]) -> Figures:
    """Median of each figure over the rounds, of those that have it."""
    names = dict.fromkeys(name for figures in rounds for name in figures)
    values = {n: [v for r in rounds if (v := r.get(n)) is not None] for n in names}
    return {name: statistics.median(found) if found else None for name, found in values.items()}


def main() -> None:
    """Print two tables."""
    parser = json_report.parser(__doc__)
    parser.add_argument("--seconds", type=float, default=3.0, help="of each loop in a round")
    parser.add_argument("--rounds", type=int, default=5)
    options = parser.parse_args()
    seconds = options.seconds
    results: list[json_report.Result] = []
    empty = EmptyLoop()
    print("| loop | rate | late p50 | late p99 | ratio | cost p50 | cost p99 | missed | core |")
    print("|---|---|---|---|---|---|---|---|---|")
    for hz in (1000.0, 4000.0):
        _, scheduling = haptic_loop(hz, 0.5)
        priority = LOOP_PRIORITY if "SCHED_FIFO" in scheduling else 0
        rounds: dict[str, list[Figures]] = {}
        for _ in range(options.rounds):
            for name, figures in (
                ("haptic loop", haptic_loop(hz, seconds)[0]),
                ("cyclictest", of_wakeups(cyclictest(hz, seconds, priority, awake=False))),
                (
                    "cyclictest, kept awake",
                    of_wakeups(cyclictest(hz, seconds, priority, awake=True)),
                ),
                ("empty C loop", of_wakeups(empty.run(hz, seconds, priority))),
            ):
                rounds.setdefault(name, []).append(figures)
        ours = rounds["haptic loop"]
        for name, seen in rounds.items():
            ratios: list[Figures] = [
                {"late_p99_ratio": ratio(a["late_p99_s"], b["late_p99_s"])}
                for a, b in zip(ours, seen, strict=True)
            ]
            row = median(seen) | median(ratios)
            results.append(
                {"loop": name, "rate_hz": hz, "scheduling": scheduling, "warm_up_s": WARM_UP, **row}
            )
            print(line(name, hz, row))
    empty.close()
    print("\n| cohaptic touch at 1 kHz | both processes | network | loop |\n|---|---|---|---|")
    for geometry in ("plane", "mesh"):
        row = median([touch(geometry, seconds) for _ in range(options.rounds)])
        results.append({"touch": geometry, "started_s": STARTED, **row})
        cells = (percent(row[name]) for name in ("cpu", "network_cpu", "loop_cpu"))
        print(f"| {geometry} patches | {' | '.join(cells)} |")
    json_report.write(options, results)


def ratio(ours: float | None, other: float | None) -> float | None:
    """Our figure over another one; None where one is missing."""
    return None if ours is None or not other else ours / other


def line(name: str, hz: float, row: Figures) -> str:
    """A row of the first table; a loop that could not run says so."""
    if row["late_p99_s"] is None:
        return f"| {name} | {hz:.0f} Hz | not installed, or not allowed |"
    times = [microseconds(row.get(n)) for n in ("late_p50_s", "late_p99_s")]
    costs = [microseconds(row.get(n)) for n in ("cost_p50_s", "cost_p99_s")]
    fractions = [percent(row.get(n)) for n in ("missed", "cpu")]
    cells = [*times, f"{row['late_p99_ratio']:.2f}", *costs, *fractions]
    return f"| {name} | {hz:.0f} Hz | {' | '.join(cells)} |"


def microseconds(value: float | None) -> str:
    """A time [s] in words."""
    return "" if value is None else f"{1e6 * value:.0f} us"


def percent(value: float | None) -> str:
    """A share in words."""
    return "" if value is None else f"{100.0 * value:.2f} %"


if __name__ == "__main__":
    main()
