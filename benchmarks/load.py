"""How many users a core, or this machine, serves in many rooms with ticks that are on time.

    python benchmarks/load.py [--room-users 8] [--rooms 2 4 8 12 16 20 25] [--seconds 5]
        [--rounds 3] [--stopped] [--limit-seconds 900] [--json FILE]

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

Rows come as soon as they are known, and what is being done goes to the standard error. A server of
which less than nine tenths of the patches arrive is not given more rooms, and no row is begun after
`--limit-seconds`; what was left out is said. A user whom a server closes is told of, and missing.
"""

from __future__ import annotations

import argparse
import contextlib
import math
import os
import signal
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import json_report
import progress
from cohaptic_server.demo.processes import DemoFailed
from core_users import PERIOD
from load_rooms import Rooms
from load_users import bare, crowd
from users_per_core import Process

WARM_UP = 1.5  # s of a row in which users join and forces rise
ON_TIME = 4e-3  # s at the 99th percentile
EARLY = 5e-4  # s by which a tick may be before that grid, which is an estimate
ARRIVED = 0.99  # of the patches that are due
HOPELESS = 0.9  # of them, below which more rooms would say nothing
JOINED = 20.0  # s for all users of a row to get their first patch
PATCH = 104  # bytes of a plane


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
    deadline = time.perf_counter() + JOINED
    first = [0] * len(urls)
    while min(first) < users:
        if time.perf_counter() > deadline:
            progress.say(f"not every user has a patch after {JOINED:g} s")
            break
        time.sleep(0.3)
        first = [n + patches for n, (patches, _, _) in zip(first, everybody.ask()[0], strict=True)]
    time.sleep(WARM_UP)
    (_, cpu, _), before, start = everybody.ask(), spent(), time.perf_counter()
    time.sleep(seconds)
    (came, cpu_after, closed), after = everybody.ask(), spent()
    took = time.perf_counter() - start
    everybody.pipe.send(False)
    if closed:
        progress.say(f"{len(closed)} users were closed, the first with: {closed[0]}")
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
    try:
        for held_up in (False, True):
            if held_up:
                os.kill(server.pids[-1], signal.SIGSTOP)
            progress.say(f"{rooms - 1} rooms, and one that {'stands' if held_up else 'runs'}")
            _, late = measure(server, everybody, server.urls[:-1], users, seconds)
            p99.append(float(np.quantile(np.concatenate(late), 0.99)))
    finally:
        with contextlib.suppress(ProcessLookupError):  # its lease may have been over
            os.kill(server.pids[-1], signal.SIGCONT)
        server.end()
    print(
        f"\none room stopped: the others' p99 {1e3 * p99[0]:.2f} ms before,"
        f" {1e3 * p99[1]:.2f} ms meanwhile",
        flush=True,
    )
    return {
        "kind": "one stopped",
        "rooms": rooms,
        "late_p99_before_s": p99[0],
        "late_p99_s": p99[1],
    }


@dataclass
class Players:
    """The processes beside our server.

    Args:
        beside: Users on the core that no server has.
        free: Users on all cores.
        bare: The bare server.
        bare_url: Where it is.
    """

    beside: Process
    free: Process
    bare: Process
    bare_url: str

    def end(self) -> None:
        """End them."""
        for process in (self.beside, self.free, self.bare):
            process.end()


def compare(
    folder: Path, rooms: int, kinds: set[str], options: argparse.Namespace, who: Players
) -> dict[str, Row]:
    """The middle row of each kind of server, for one number of rooms."""
    each, rounds, seconds = options.room_users, options.rounds, options.seconds
    limit = options.limit_seconds
    cores = sorted(os.sched_getaffinity(0))
    rows: dict[str, list[Row]] = {kind: [] for kind in kinds}
    for on, together in (({cores[0]}, ("ours", "bare")), (set(cores), ("all cores",))):
        ours = None if not kinds & set(together) - {"bare"} else Rooms(folder, rooms, each, on)
        try:
            for done in range(rounds):
                for kind in (kind for kind in together if kind in kinds):
                    if done and (rows[kind][-1].arrived < HOPELESS or progress.spent() > limit):
                        continue
                    progress.say(f"{kind}, {rooms} rooms, round {done + 1} of {rounds}")
                    server: Rooms | Process = who.bare if ours is None or kind == "bare" else ours
                    bare_urls = [f"{who.bare_url}/{PATCH}"] * rooms
                    urls = server.urls if isinstance(server, Rooms) else bare_urls
                    users = who.free if kind == "all cores" else who.beside
                    rows[kind].append(measure(server, users, urls, each, seconds)[0])
        finally:
            if ours is not None:
                ours.end()
    return {kind: middle(found) for kind, found in rows.items()}


def main() -> None:
    """Print the tables."""
    parser = json_report.parser(__doc__)
    parser.add_argument("--room-users", type=int, default=8)
    parser.add_argument("--rooms", type=int, nargs="*", default=[2, 4, 8, 12, 16, 20, 25])
    parser.add_argument("--seconds", type=float, default=5.0)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--stopped", action="store_true")
    parser.add_argument("--limit-seconds", type=float, default=900.0)
    options = parser.parse_args()
    each, cores = options.room_users, sorted(os.sched_getaffinity(0))
    results: list[json_report.Result] = []
    most = {"ours": 0, "bare": 0, "all cores": 0}
    kinds = set(most)
    print("| server | rooms | users | late p50 | p99 | most | arrived | rooms' cores | front's"
          " | users' | server per patch | holds |\n|" + "---|" * 12, flush=True)  # fmt: skip
    simple = Process(bare, {cores[0]})
    who = Players(
        Process(crowd, {cores[-1]}), Process(crowd, set(cores)), simple, simple.pipe.recv()
    )
    try:
        with tempfile.TemporaryDirectory() as name:
            if options.stopped:  # first: it says the most, and takes the least
                results.append(stopped(Path(name), 4, each, who.free, options.seconds))
            for rooms in options.rooms:
                if not kinds or progress.spent() > options.limit_seconds:
                    progress.say(f"left out: {rooms} rooms and more")
                    break
                found = compare(Path(name), rooms, kinds, options, who)
                for kind in (kind for kind in most if kind in found):
                    row = found[kind]
                    results.append(tell(kind, rooms, rooms * each, row))
                    if row.holds:
                        most[kind] = max(most[kind], rooms * each)
                    if row.arrived < HOPELESS:
                        kinds.discard(kind)
    except DemoFailed as failed:
        progress.say(f"{failed}; what follows is not measured")
    finally:
        who.end()
    ratio = most["ours"] / most["bare"] if most["bare"] else float("nan")
    said = ", ".join(f"{kind} {users}" for kind, users in most.items())
    print(f"\nmost users with p99 <= {1e3 * ON_TIME:g} ms: {said}; ratio on one core {ratio:.2f}")
    numbers = {f"most_{kind}".replace(" ", "_"): users for kind, users in most.items()}
    results.append({"kind": "most", **numbers, "ratio": ratio})
    json_report.write(options, results)


if __name__ == "__main__":
    main()
