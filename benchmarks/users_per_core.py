"""Users per core of our server beside a bare `websockets` server that exchanges the same bytes.

    python benchmarks/users_per_core.py [--users 1 16 64] [--patches plane mesh] [--motions press
        slide] [--speed 0.2] [--seconds 3] [--rounds 3] [--still] [--json FILE]

Users send a sample and get a patch 60 times a second, over loopback, each at its own time within a
period. They are in a process of their own (`core_users.py`), and so is each server
(`core_processes.py`): a balloon in one room of at most 64, and a server of `websockets` alone that
reads the samples and sends patches of the same size. The CPU time of a server is that of its
process, divided by the patches that arrived meanwhile; `world` is the part of it in the world's
tick, which the bare server does not have, and `wire` is the rest. With `--still` the world stands
once forces have risen, and the wire alone is left, with real patches. The first second of each row,
while users come and their forces rise, is left out. Rounds alternate between the servers; each
number is the median of the rounds. The last column is the ratio of users per core, ours over bare.
"""

from __future__ import annotations

import argparse
import multiprocessing
import time
from collections.abc import Callable
from multiprocessing.connection import Connection as Pipe
from multiprocessing.context import SpawnProcess
from statistics import median
from typing import Any

import json_report
from core_processes import bare, ours
from core_users import PERIOD, crowd

WARM_UP = 1.0  # s at the start of a row that are not counted: users join, and their forces rise
_ANSWER = 120.0  # s; users who come one after another to a server that is slow take long
Case = tuple[int, str, str]  # users, patches, motion


class Process:
    """A process and the pipe to it.

    Args:
        target: Its main function; the pipe is its last argument.
        args: Its other arguments.
    """

    def __init__(self, target: Callable[..., None], *args: Any) -> None:
        context = multiprocessing.get_context("spawn")
        self.pipe: Pipe
        self.pipe, theirs = context.Pipe()
        self._process: SpawnProcess = context.Process(target=target, args=(*args, theirs))
        self._process.start()
        theirs.close()

    def ask(self) -> Any:
        """What it says now; raises TimeoutError if it says nothing for `_ANSWER`."""
        self.pipe.send(True)
        if not self.pipe.poll(_ANSWER):
            raise TimeoutError(f"process {self._process.pid} says nothing for {_ANSWER:g} s")
        return self.pipe.recv()

    def end(self) -> None:
        """Close the pipe and wait."""
        self.pipe.close()
        self._process.join()


def measure(
    server: Process, users_process: Process, url: str, case: Case, options: argparse.Namespace
) -> tuple[float, float, float, float]:
    """One row: CPU time of the server for each patch, that in the world, patches a second and
    user, and bytes of a patch."""
    users, patches, motion = case
    users_process.pipe.send((url, users, patches, motion, options.speed))
    while users_process.ask()[0] < users:
        time.sleep(0.05)
    time.sleep(WARM_UP)
    (cpu, world), (count, size), start = server.ask(), users_process.ask(), time.perf_counter()
    time.sleep(options.seconds)
    (cpu_after, world_after), (count_after, size_after) = server.ask(), users_process.ask()
    seconds, came = time.perf_counter() - start, count_after - count
    users_process.pipe.send(False)
    return (
        (cpu_after - cpu) / came,
        (world_after - world) / came,
        came / seconds / users,
        (size_after - size) / came,
    )


def report(case: Case, rows: dict[str, list[tuple[float, ...]]]) -> json_report.Result:
    """Print one row of the table."""
    users, patches, motion = case
    cpu, world, rate, size = (median(values) for values in zip(*rows["ours"], strict=True))
    bare_cpu = median(row[0] for row in rows["bare"])
    per_core, bare_per_core = PERIOD / cpu, PERIOD / bare_cpu
    ratios = [b[0] / o[0] for o, b in zip(rows["ours"], rows["bare"], strict=True)]
    print(
        f"| {users} | {patches} | {motion} | {size:.0f} | {rate:.1f} | {1e6 * bare_cpu:.0f} us"
        f" | {1e6 * cpu:.0f} us | {1e6 * world:.0f} us | {1e6 * (cpu - world):.0f} us"
        f" | {bare_per_core:.0f} | {per_core:.0f} | {median(ratios):.2f} |",
        flush=True,
    )
    return {
        "users": users,
        "patches": patches,
        "motion": motion,
        "patch_bytes": size,
        "patches_per_s": rate,
        "bare_cpu_s": bare_cpu,
        "cpu_s": cpu,
        "world_s": world,
        "wire_s": cpu - world,
        "bare_users_per_core": bare_per_core,
        "users_per_core": per_core,
        "ratio": median(ratios),
        "least_ratio": min(ratios),
        "largest_ratio": max(ratios),
    }


def main() -> None:
    """Print the table."""
    parser = json_report.parser(__doc__)
    parser.add_argument("--users", type=int, nargs="*", default=[1, 16, 64])
    parser.add_argument("--patches", nargs="*", default=["plane", "mesh"])
    parser.add_argument("--motions", nargs="*", default=["press", "slide"])
    parser.add_argument("--speed", type=float, default=0.2, help="of sliding, in m/s")
    parser.add_argument("--seconds", type=float, default=3.0, help="of a row that count")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--subdivisions", type=int, default=3, help="4 gives 2,562 vertices")
    parser.add_argument("--still", action="store_true", help="the wire alone: a world that stands")
    options = parser.parse_args()
    servers = {"ours": Process(_ours, options.subdivisions, options.still), "bare": Process(bare)}
    everybody = Process(crowd)
    urls = {name: server.pipe.recv() for name, server in servers.items()}
    print(
        "| users | patches | motion | bytes | /s | bare | ours | world | wire | bare users/core",
        end="",
    )
    print(" | users/core | ratio |\n|" + "---|" * 12)
    results: list[json_report.Result] = []
    for users in options.users:
        for patches in options.patches:
            for motion in options.motions:
                case: Case = (users, patches, motion)
                rows: dict[str, list[tuple[float, ...]]] = {"ours": [], "bare": []}
                for _ in range(options.rounds):
                    row = measure(servers["ours"], everybody, urls["ours"], case, options)
                    rows["ours"].append(row)
                    path = f"{urls['bare']}/{row[3]:.0f}"
                    rows["bare"].append(measure(servers["bare"], everybody, path, case, options))
                results.append(report(case, rows))
    for process in (everybody, *servers.values()):
        process.end()
    json_report.write(options, results)


def _ours(subdivisions: int, still: bool, pipe: Pipe) -> None:
    ours(pipe, subdivisions, still)


if __name__ == "__main__":
    main()
