"""How many users a core, or this machine, serves in many rooms with ticks that are on time.

    python benchmarks/load.py [--room-users 8] [--rooms 2 4 8 12 16 20 25] [--seconds 5]
        [--rounds 3] [--stopped] [--json FILE]

`cohaptic serve --config` has a process for each room. Each user sends a sample and gets a patch 60
times a second, over loopback, from one process that plays them all. A row has the lateness of ticks
as the patches tell it: their times against a grid of 1/60 s that most of them agree about, with a
tick that is left out counted as one period late. First the servers run on the first core alone and
the users on the last, ours and a bare server of `websockets` that reads the samples and sends as
many bytes at the same rate, in turns; the ratio of the most users with p99 <= 4 ms and at most 1 %
of the patches missing is stated at the end. Then ours has all cores, with the users on them too; of
that the time of the processors is told apart: rooms, front and users. `users_per_core.py` tells
that of a room apart, into its world and its wire. With `--stopped` one of the rooms is then held up
by SIGSTOP, and the lateness of the others is measured before and meanwhile.
"""

from __future__ import annotations

import math
import os
import re
import signal
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import json_report
from cohaptic_server.demo.processes import Process as Serving
from core_users import PERIOD
from load_users import bare, crowd
from users_per_core import Process

WARM_UP = 1.5  # s of a row in which users join and forces rise
ON_TIME = 4e-3  # s at the 99th percentile
EARLY = 5e-4  # s by which a tick may be before that grid, which is an estimate
ARRIVED = 0.99  # of the patches that are due
PATCH = 104  # bytes of a plane
_FREE = """[limits]
open = 2000
open_in_all = 4000
connections = "1000:4000"
joins = "1000:4000"
"""


@dataclass(frozen=True)
class Row:
    """One measurement.

    Args:
        late: Lateness of ticks at the 50th and 99th percentile, and the largest [s].
        arrived: Patches over those that were due.
        rooms, front, users: Processor time of each over the time [cores].
    """

    late: tuple[float, float, float]
    arrived: float
    rooms: float
    front: float
    users: float

    @property
    def holds(self) -> bool:
        """Whether ticks were on time."""
        return self.late[1] <= ON_TIME and self.arrived >= ARRIVED


class Rooms:
    """Our server with many rooms, on some cores."""

    def __init__(self, folder: Path, rooms: int, room_users: int, cores: set[int]) -> None:
        path, self._log = folder / "rooms.toml", folder / "server.log"
        limits = _FREE.replace("[limits]", "[rooms.{0}.limits]")
        tables = "".join(
            f'[rooms.r{i}]\nbody = "balloon"\nmax_users = {room_users}\n' + limits.format(f"r{i}")
            for i in range(rooms)
        )
        path.write_text(f"port = 0\nmax_users = {rooms * room_users}\n{_FREE}{tables}")
        before = os.sched_getaffinity(0)
        os.sched_setaffinity(0, cores)  # its processes inherit it
        try:
            self._process = Serving("serve", "--config", str(path), log=self._log)
            url = self._process.first_line().removeprefix("listening ")
        finally:
            os.sched_setaffinity(0, before)
        self.urls = [f"{url}/r/r{i}" for i in range(rooms)]
        opened = dict(re.findall(r"room r(\d+) is open, process (\d+)", self._log.read_text()))
        self.pids = [int(opened[str(i)]) for i in range(rooms)]

    def spent(self) -> tuple[float, float]:
        """Processor time of the rooms and of the front so far [s]."""
        return sum(map(processor_time, self.pids)), processor_time(self._process.pid)

    def end(self) -> None:
        """End it."""
        self._process.wait()


def processor_time(pid: int) -> float:
    """Of a process so far [s]."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def lateness(ticks: list[float]) -> np.ndarray:
    """Of each tick that was due between the first and the last [s]; shape (ticks,)."""
    t = np.asarray(ticks)
    if len(t) < 2:
        return np.full(1, PERIOD)
    # Where the grid lies is what most ticks agree about: one that is late by most of a period is no
    # early one, though it looks like that.
    turns = 2.0 * np.pi * (t - t[0]) / PERIOD
    angle = math.atan2(float(np.sin(turns).sum()), float(np.cos(turns).sum()))
    offset = (
        np.mod(t - t[0] - angle / (2.0 * math.pi) * PERIOD + 0.5 * PERIOD, PERIOD) - 0.5 * PERIOD
    )
    earliest = np.quantile(offset[np.abs(offset) < 0.25 * PERIOD], 0.02)
    phase = np.maximum(np.mod(offset - earliest + EARLY, PERIOD) - EARLY, 0.0)
    due = round((t[-1] - t[0]) / PERIOD) + 1
    return np.concatenate([phase, np.full(max(0, due - len(t)), PERIOD)])


def measure(server: Rooms | Process, everybody: Process, urls: list[str], users: int,
            seconds: float) -> tuple[Row, list[np.ndarray]]:  # fmt: skip
    """One row, and the lateness of each room's ticks [s]."""

    def spent() -> tuple[float, float]:
        return server.spent() if isinstance(server, Rooms) else (float(server.ask()), 0.0)

    everybody.pipe.send((urls, users))
    deadline = time.perf_counter() + 60.0
    while any(patches < users for patches, _, _ in everybody.ask()[0]):
        if time.perf_counter() > deadline:
            break
        time.sleep(0.3)
    time.sleep(WARM_UP)
    (_, cpu), before, start = everybody.ask(), spent(), time.perf_counter()
    time.sleep(seconds)
    (came, cpu_after), after, took = everybody.ask(), spent(), time.perf_counter() - start
    everybody.pipe.send(False)
    rooms = [lateness(ticks) for _, _, ticks in came]
    late = np.concatenate(rooms)
    row = Row(
        (float(np.quantile(late, 0.5)), float(np.quantile(late, 0.99)), float(late.max())),
        sum(patches for patches, _, _ in came) * PERIOD / (took * users * len(urls)),
        (after[0] - before[0]) / took,
        (after[1] - before[1]) / took,
        (cpu_after - cpu) / took,
    )
    return row, rooms


def middle(rows: list[Row]) -> Row:
    """The row with the median of the lateness at the 99th percentile."""
    return sorted(rows, key=lambda row: row.late[1])[len(rows) // 2]


def tell(kind: str, rooms: int, users: int, row: Row) -> json_report.Result:
    """Print one row."""
    late = " | ".join(f"{1e3 * value:.2f} ms" for value in row.late)
    per_patch = 1e6 * (row.rooms + row.front) * PERIOD / (users * max(row.arrived, 1e-9))
    print(
        f"| {kind} | {rooms} | {users} | {late} | {100 * row.arrived:.1f} % | {row.rooms:.2f}"
        f" | {row.front:.2f} | {row.users:.2f} | {per_patch:.0f} us"
        f" | {'yes' if row.holds else 'no'} |",
        flush=True,
    )
    return {
        "kind": kind, "rooms": rooms, "users": users, "late_p50_s": row.late[0],
        "late_p99_s": row.late[1], "late_max_s": row.late[2], "arrived": row.arrived,
        "rooms_cores": row.rooms, "front_cores": row.front, "users_cores": row.users,
        "server_s_per_patch": 1e-6 * per_patch, "holds": row.holds,
    }  # fmt: skip


def stopped(
    folder: Path, rooms: int, users: int, everybody: Process, seconds: float
) -> json_report.Result:
    """Lateness of all rooms but one, before that one is held up, and meanwhile."""
    server = Rooms(folder, rooms, users, os.sched_getaffinity(0))
    p99: list[float] = []
    for held_up in (False, True):
        if held_up:
            os.kill(server.pids[-1], signal.SIGSTOP)
        _, late = measure(server, everybody, server.urls[:-1], users, seconds)
        p99.append(float(np.quantile(np.concatenate(late), 0.99)))
    os.kill(server.pids[-1], signal.SIGCONT)
    server.end()
    print(
        f"\none room stopped: the others' p99 {1e3 * p99[0]:.2f} ms before,"
        f" {1e3 * p99[1]:.2f} ms meanwhile"
    )
    return {
        "kind": "one stopped",
        "rooms": rooms,
        "late_p99_before_s": p99[0],
        "late_p99_s": p99[1],
    }


def main() -> None:
    """Print the tables."""
    parser = json_report.parser(__doc__)
    parser.add_argument("--room-users", type=int, default=8)
    parser.add_argument("--rooms", type=int, nargs="*", default=[2, 4, 8, 12, 16, 20, 25])
    parser.add_argument("--seconds", type=float, default=5.0)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--stopped", action="store_true")
    options = parser.parse_args()
    each, cores = options.room_users, sorted(os.sched_getaffinity(0))
    one, other, all_cores = {cores[0]}, {cores[-1]}, set(cores)
    results: list[json_report.Result] = []
    most = {"ours": 0, "bare": 0, "all cores": 0}
    print("| server | rooms | users | late p50 | p99 | most | arrived | rooms' cores | front's"
          " | users' | server per patch | holds |\n|" + "---|" * 12)  # fmt: skip
    beside, free, simple = Process(crowd, other), Process(crowd, all_cores), Process(bare, one)
    bare_url = simple.pipe.recv()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for rooms in options.rooms:
            rows: dict[str, list[Row]] = {kind: [] for kind in most}
            ours = Rooms(folder, rooms, each, one)
            for _ in range(options.rounds):
                rows["ours"].append(measure(ours, beside, ours.urls, each, options.seconds)[0])
                urls = [f"{bare_url}/{PATCH}"] * rooms
                rows["bare"].append(measure(simple, beside, urls, each, options.seconds)[0])
            ours.end()
            ours = Rooms(folder, rooms, each, all_cores)
            for _ in range(options.rounds):
                rows["all cores"].append(measure(ours, free, ours.urls, each, options.seconds)[0])
            ours.end()
            for kind, found in rows.items():
                row = middle(found)
                results.append(tell(kind, rooms, rooms * each, row))
                if row.holds:
                    most[kind] = max(most[kind], rooms * each)
        if options.stopped:
            results.append(stopped(folder, 4, each, free, options.seconds))
    for process in (beside, free, simple):
        process.end()
    ratio = most["ours"] / most["bare"] if most["bare"] else float("nan")
    said = ", ".join(f"{kind} {users}" for kind, users in most.items())
    print(f"\nmost users with p99 <= {1e3 * ON_TIME:g} ms: {said}; ratio on one core {ratio:.2f}")
    numbers = {f"most_{kind}".replace(" ", "_"): users for kind, users in most.items()}
    results.append({"kind": "most", **numbers, "ratio": ratio})
    json_report.write(options, results)


if __name__ == "__main__":
    main()
