"""Lateness of rooms beside one whose tick takes 30 ms and one that is held up by SIGSTOP.

    python benchmarks/bad_neighbours.py [--rooms 4] [--room-users 4] [--seconds 6] [--rounds 4]
        [--json FILE]

A server has some rooms with the balloon, whose users press, and two bad ones with a user each. In
turns these are as good as the others, and bad: a tick of one takes 30 ms of the processor, and the
process of the other is stopped, for less than its lease. Of the others the lateness of ticks is
told, as `load.py` has it: at the 99th percentile, all rounds of a kind together, and for each.
"""

from __future__ import annotations

import asyncio
import os
import signal
import tempfile
import time
from collections.abc import Sequence
from functools import partial
from multiprocessing.connection import Connection as Pipe
from pathlib import Path
from typing import Any

import numpy as np

import json_report
from cohaptic_ops.rooms.config import RoomsConfig, RoomTable
from cohaptic_ops.rooms.rooms_server import RoomsServer
from cohaptic_server.bodies.balloon.balloon import Balloon, BalloonSettings
from cohaptic_server.bodies.body import Body, DenseResponse, Load, Response
from cohaptic_server.settings import ServerSettings
from load_users import crowd
from tick_lateness import lateness
from users_per_core import Process

SLOW_TICK = 30e-3  # s of a processor
LEASE = 120.0  # s; a room that is stopped for less is not started again
SETTLE = 3.0  # s in which a room that becomes slow loses its precedence, or gets it back
JOINED = 60.0  # s for all users to have patches
LIMITS: dict[str, Any] = {"joins": "1000:4000", "connections": "1000:4000", "open": 2000}


class Slowed(Balloon):
    """One whose tick takes `SLOW_TICK` while there is a file.

    Args:
        file: Which.
    """

    def __init__(self, file: Path) -> None:
        super().__init__(BalloonSettings(subdivisions=2, contact_radius=0.03))
        self._file = file
        self._answered = 0.0

    def respond(self, loads: Sequence[Load], before: Response | None = None) -> DenseResponse:
        """As the balloon, once in a tick behind a loop that takes so long."""
        if time.monotonic() - self._answered > 5e-3 and self._file.exists():
            until = time.process_time() + SLOW_TICK
            while time.process_time() < until:
                pass
        found = super().respond(loads, before)
        self._answered = time.monotonic()
        return found


def good(_settings: ServerSettings) -> Body:
    """The body of a room that disturbs nobody."""
    return Balloon()


def slowed(file: Path, _settings: ServerSettings) -> Body:
    """The body of the slow room."""
    return Slowed(file)


def serve(rooms: int, file: Path, pipe: Pipe) -> None:
    """Main function of the server: says where it is, and the process of the room to be stopped.

    Args:
        rooms: Good ones, `r0` and so on; the others are `slow` and `stopped`.
        file: While it is there, `slow` is slow.
        pipe: Ends it.
    """

    async def live() -> None:
        names = [*(f"r{i}" for i in range(rooms)), "stopped", "slow"]
        table: dict[str, Any] = {"body": "balloon", "limits": LIMITS}
        whole: dict[str, Any] = {"port": 0, "lease": LEASE, "limits": LIMITS}
        config = RoomsConfig(rooms={name: RoomTable(**table) for name in names}, **whole)
        builds = dict.fromkeys(names, good) | {"slow": partial(slowed, file)}
        rooms_server = RoomsServer(config, builds)
        try:
            url = await rooms_server.start()
            process = rooms_server.supervisors["stopped"].process
            assert process is not None
            pipe.send((url, process.pid))
            await asyncio.to_thread(pipe.recv)
        except EOFError:
            pass
        finally:
            await rooms_server.drain()

    asyncio.run(live())


def measure(everybody: Process, rooms: int, seconds: float) -> np.ndarray:
    """Lateness of all ticks of the good rooms [s]; their addresses come first."""
    everybody.ask()
    time.sleep(seconds)
    came, _, closed = everybody.ask()
    if closed:
        raise SystemExit(f"{len(closed)} users were closed, the first with: {closed[0]}")
    return np.concatenate([lateness(ticks) for _, _, ticks in came[:rooms]])


def play(rooms: int, users: int, seconds: float, rounds: int) -> list[json_report.Result]:
    """All rounds, good ones and bad ones in turn."""
    found: dict[str, list[np.ndarray]] = {"alone": [], "beside": []}
    with tempfile.TemporaryDirectory() as name:
        file = Path(name) / "slow"
        server = Process(serve, rooms, file)
        cores = os.sched_getaffinity(0)
        everybody, others = Process(crowd, cores), Process(crowd, cores)
        try:
            reported: tuple[str, int] = server.pipe.recv()
            url, pid = reported
            urls = [f"{url}/r/r{i}" for i in range(rooms)]
            everybody.pipe.send((urls, [users] * rooms))
            others.pipe.send(([f"{url}/r/slow", f"{url}/r/stopped"], [1, 1]))
            until, first = time.monotonic() + JOINED, [0]
            while min(first) == 0 and time.monotonic() < until:
                time.sleep(0.5)
                first = [patches for patches, _, _ in everybody.ask()[0]]
            for number in range(rounds):
                for kind in found:
                    if kind == "beside":
                        file.touch()
                        os.kill(pid, signal.SIGSTOP)
                    time.sleep(SETTLE)
                    late = measure(everybody, rooms, seconds)
                    if kind == "beside":
                        os.kill(pid, signal.SIGCONT)
                        file.unlink()
                    found[kind].append(late)
                    p99 = 1e3 * float(np.quantile(late, 0.99))
                    print(f"round {number + 1}, {kind}: p99 {p99:.2f} ms", flush=True)
            slow_ticks = len(others.ask()[0][0][2])
        finally:
            for process in (everybody, others):
                process.pipe.send(False)
                process.end()
            server.end()
    rows: list[json_report.Result] = []
    for kind, parts in found.items():
        late = np.concatenate(parts)
        rows.append({
            "kind": kind, "rooms": rooms, "users": rooms * users,
            "late_p50_s": float(np.quantile(late, 0.5)),
            "late_p99_s": float(np.quantile(late, 0.99)), "late_max_s": float(late.max()),
            "worst_p99_of_a_round_s": max(float(np.quantile(part, 0.99)) for part in parts),
            "ticks_of_slow": slow_ticks,
        })  # fmt: skip
    return rows


def main() -> None:
    """Print what came of it."""
    parser = json_report.parser(__doc__)
    parser.add_argument("--rooms", type=int, default=4)
    parser.add_argument("--room-users", type=int, default=4)
    parser.add_argument("--seconds", type=float, default=6.0)
    parser.add_argument("--rounds", type=int, default=4)
    options = parser.parse_args()
    rows = play(options.rooms, options.room_users, options.seconds, options.rounds)
    for row in rows:
        print({k: f"{v:.3g}" if isinstance(v, float) else v for k, v in row.items()}, flush=True)
    json_report.write(options, rows)


if __name__ == "__main__":
    main()
