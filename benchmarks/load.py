"""How many users a core, and this machine, serve in many rooms with ticks that are on time.

    python benchmarks/load.py [--parts core machine neighbours] [--room-users 8] [--core-rooms 12]
        [--rooms 25] [--rounds 3] [--seconds 4] [--precision 0.08] [--limit-seconds 660]
        [--json FILE]

`cohaptic serve --config` has a process for each room. Each user sends a sample and gets a patch 60
times a second, over loopback, from one process that plays them all. A number of users holds if the
lateness of ticks, as the patches tell it (`tick_lateness.py`), is at most 4 ms at the 99th
percentile and at most 1 % of the patches are missing.

`core`: the servers run on the first core alone and the users on the last, ours and a bare server of
`websockets` that reads the samples and sends as many bytes at the same rate. In each round the most
users that hold are searched for, of both in turn; the ratio is told of each round, and its median.
`machine`: ours has all cores, with the users on them too: all rooms with all their users, and where
they do not hold the most that do. The time of the processors is told apart: rooms, front and users;
`users_per_core.py` tells that of a room apart, into its world and its wire. `neighbours`: four
rooms beside one whose tick takes 30 ms and one that SIGSTOP holds up (`bad_neighbours.py`).

Rows come as soon as they are known, and what is being done goes to the standard error. No row is
begun after `--limit-seconds`; what was left out is said. A user whom a server closes is told of,
and missing.
"""

from __future__ import annotations

import argparse
import math
import os
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from statistics import median

import numpy as np

import json_report
import progress
from bad_neighbours import play
from cohaptic_tools.demo.processes import DemoFailed
from core_users import PERIOD
from load_rooms import Rooms
from load_search import largest
from load_users import bare, crowd
from tick_lateness import lateness
from users_per_core import Process

PARTS = ["core", "machine", "neighbours"]
FIRST = 32  # users of the first try of ours; a bare server has had four times as many, and more
MAX_BARE = 800  # of one process that plays them
WARM_UP = 1.5  # s of a row in which users join and forces rise
ON_TIME = 4e-3  # s at the 99th percentile
ARRIVED = 0.99  # of the patches that are due
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


def measure(server: Rooms | Process, everybody: Process, urls: list[str], users: list[int],
            seconds: float) -> Row:  # fmt: skip
    """One row: so many users at each address."""

    def spent() -> tuple[float, float]:
        return server.spent() if isinstance(server, Rooms) else (float(server.ask()), 0.0)

    everybody.pipe.send((urls, users))
    deadline = time.perf_counter() + JOINED
    first = [0] * len(urls)
    while any(came < here for came, here in zip(first, users, strict=True)):
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
    late = np.concatenate([lateness(ticks) for _, _, ticks in came])
    return Row(
        (float(np.quantile(late, 0.5)), float(np.quantile(late, 0.99)), float(late.max())),
        sum(patches for patches, _, _ in came) * PERIOD / (took * sum(users)),
        (after[0] - before[0]) / took,
        (after[1] - before[1]) / took,
        (cpu_after - cpu) / took,
    )


def spread(users: int, max_each: int) -> list[int]:
    """So many users over as few rooms as hold them, as evenly as it goes."""
    rooms = math.ceil(users / max_each)
    return [users // rooms + (k < users % rooms) for k in range(rooms)]


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


class OutOfTimeError(Exception):
    """No row is begun any more."""


class Ladder:
    """Rows of one server after another, each with its number of users.

    Args:
        options: Options of the command line.

    Attributes:
        results: Results of all rows.
    """

    def __init__(self, options: argparse.Namespace) -> None:
        self._options = options
        self.results: list[json_report.Result] = []

    def row(
        self, kind: str, server: Rooms | Process, url: str, everybody: Process, users: int
    ) -> Row:
        """Measure so many users and print it; raises OutOfTimeError.

        Args:
            kind: Kind of the server, for the table.
            server: That one.
            url: URL of the bare server; ours knows its own.
            everybody: Who plays the users.
            users: How many.
        """
        if progress.spent() > self._options.limit_seconds:
            raise OutOfTimeError
        each = spread(users, self._options.room_users)
        urls = (
            server.wake(len(each)) if isinstance(server, Rooms) else [f"{url}/{PATCH}"] * len(each)
        )
        row = measure(server, everybody, urls, each, self._options.seconds)
        self.results.append(tell(kind, len(each), users, row))
        return row


def core(folder: Path, ladder: Ladder, options: argparse.Namespace) -> json_report.Result:
    """The most users of one core, ours and of a bare server, in turns."""
    cores = sorted(os.sched_getaffinity(0))
    everybody, simple = Process(crowd, {cores[-1]}), Process(bare, {cores[0]})
    url, ours = simple.pipe.recv(), None
    found: dict[str, list[int]] = {"ours": [], "bare": []}
    try:
        ours = Rooms(folder, options.core_rooms, options.room_users, {cores[0]})
        limits = {"ours": options.core_rooms * options.room_users, "bare": MAX_BARE}
        servers: dict[str, Rooms | Process] = {"ours": ours, "bare": simple}
        start = {"ours": FIRST, "bare": 4 * FIRST}
        for done in range(options.rounds):
            for kind, server in servers.items():
                progress.say(f"{kind}, round {done + 1} of {options.rounds}")
                ours.wake(0)  # of the bare server's time nothing is taken

                def holds(users: int, kind: str = kind, server: Rooms | Process = server) -> bool:
                    return ladder.row(kind, server, url, everybody, users).holds

                low, high = largest(holds, start[kind], limits[kind], options.precision)
                progress.say(f"{kind}: {low} users hold, {high or 'more than the limit'} do not")
                found[kind].append(low)
                start[kind] = max(1, low)
    except OutOfTimeError:
        progress.say(f"left out: rounds after {min(map(len, found.values()))}")
    finally:
        for one in (ours, everybody, simple):
            if one is not None:
                one.end()
    both = zip(found["ours"], found["bare"], strict=False)
    ratios = [ours / bare if bare else float("nan") for ours, bare in both]
    ratio = median(ratios) if ratios else float("nan")
    print(f"\nmost users of one core with p99 <= {1e3 * ON_TIME:g} ms, by round: ours"
          f" {found['ours']}, bare {found['bare']}; ratio {ratio:.2f}, by round"
          f" {[round(r, 2) for r in ratios]}\n", flush=True)  # fmt: skip
    return {
        "kind": "one core", "ratio": ratio,
        **{f"most_{kind}": median(those) if those else None for kind, those in found.items()},
    }  # fmt: skip


def machine(folder: Path, ladder: Ladder, options: argparse.Namespace) -> json_report.Result:
    """All rooms with all their users on all cores, and where that is too much what is not."""
    whole = options.rooms * options.room_users
    everybody = Process(crowd, os.sched_getaffinity(0))
    rows: list[Row] = []
    low: int | None = None
    server = None
    try:
        server = Rooms(folder, options.rooms, options.room_users, os.sched_getaffinity(0))
        served = server

        def row(users: int) -> Row:
            return ladder.row("all cores", served, "", everybody, users)

        for _ in range(options.rounds):
            rows.append(row(whole))
        if sorted(rows, key=lambda row: row.late[1])[len(rows) // 2].holds:
            low = whole
        else:
            low, _ = largest(lambda users: row(users).holds, whole // 2, whole, options.precision)
    except OutOfTimeError:
        progress.say("left out: the rest of all cores")
    finally:
        for one in (server, everybody):
            if one is not None:
                one.end()
    p99 = [row.late[1] for row in rows]
    said = ", ".join(f"{1e3 * late:.2f}" for late in p99)
    print(f"\n{whole} users in {options.rooms} rooms on all cores: p99 {said} ms; the most that"
          f" hold: {'not known' if low is None else low}\n", flush=True)  # fmt: skip
    return {
        "kind": "machine", "users": whole, "most": low,
        "late_p99_s": median(p99) if p99 else None,
    }  # fmt: skip


def main() -> None:
    """Print the tables."""
    parser = json_report.parser(__doc__)
    parser.add_argument("--parts", nargs="*", default=PARTS, choices=PARTS)
    parser.add_argument("--room-users", type=int, default=8)
    parser.add_argument("--core-rooms", type=int, default=12, help="most on one core")
    parser.add_argument("--rooms", type=int, default=25, help="on all cores")
    parser.add_argument("--seconds", type=float, default=4.0)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--precision", type=float, default=0.08, help="of the most that hold")
    parser.add_argument("--limit-seconds", type=float, default=660.0)
    options = parser.parse_args()
    ladder = Ladder(options)
    reported: list[json_report.Result] = []
    print("| server | rooms | users | late p50 | p99 | most | arrived | rooms' cores | front's"
          " | users' | server per patch | holds |\n|" + "---|" * 12, flush=True)  # fmt: skip
    with tempfile.TemporaryDirectory() as name:
        for part, find in (("core", core), ("machine", machine)):
            if part in options.parts:
                try:
                    reported.append(find(Path(name), ladder, options))
                except DemoFailed as failed:
                    progress.say(f"{failed}; {part} is not measured")
    if "neighbours" in options.parts:
        if progress.spent() > options.limit_seconds:
            progress.say("left out: neighbours")
        else:
            rows = play(4, 4, options.seconds, options.rounds)
            reported += rows
            alone, beside = (1e3 * float(str(row["late_p99_s"])) for row in rows)
            print(f"\nbeside a slow and a stopped room: p99 {beside:.2f} ms, and {alone:.2f} ms"
                  " while both behave")  # fmt: skip
    json_report.write(options, [*ladder.results, *reported])


if __name__ == "__main__":
    main()
