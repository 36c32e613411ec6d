"""Missed ticks of a server per minute, while eight simulated users touch a large solid.

    python benchmarks/eight_users.py [--minutes 3] [--users 8] [--speed 0.2] [--whole
    [--loop-hz 1000]] [--json FILE]

A ring of 150,000 tetrahedra and 16,900 surface vertices is served at 60 Hz. Users are connections
without haptic loops (`light_users.py`), since those run on the users' own machines. They press in
place, or with `--speed` slide along the ring, all of them all the time; with `--whole` each is a
`cohaptic touch` with its loop at 1 kHz on this machine, where eight loops take most of a core and
go before the server.

A tick is missed when its patches leave after the next tick was due, and when it is left out because
the one before took that long. The warm-up, until everybody is there and 5 s more, is counted apart:
users join then and the first columns are solved. Percentiles are of one minute each.
"""

from __future__ import annotations

import argparse
import asyncio
import math
import subprocess
import sys
import tempfile
from contextlib import ExitStack
from pathlib import Path

from threadpoolctl import threadpool_limits

import json_report
from cohaptic.runtime.scheduling import SERVER_PRIORITY, prefer_this_process
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.room.tick_schedule import TickMeters
from cohaptic_server.settings import ServerSettings
from cohaptic_server.shell.column_worker import ColumnWorker
from cohaptic_server.shell.server import CohapticServer
from cohaptic_server.testing.soft_ring import RING, TUBE, fixed, ring

WARM_UP = 5.0  # s after the last user has joined


def main() -> None:
    """Print one line for each minute, and the median."""
    parser = json_report.parser(__doc__)
    parser.add_argument("--minutes", type=int, default=3)
    parser.add_argument("--minute", type=float, default=60.0, help="length of one in seconds")
    parser.add_argument("--users", type=int, default=8)
    parser.add_argument("--speed", type=float, default=0.0, help="of sliding, in m/s; 0 to press")
    parser.add_argument("--whole", action="store_true", help="users with their haptic loops")
    parser.add_argument("--loop-hz", type=float, default=1000.0)
    parser.add_argument("--geometry", choices=("plane", "sphere", "mesh"), default="mesh")
    parser.add_argument("--rhythm-s", type=float, default=2.0, help="of presses; 0 to rest")
    args = parser.parse_args()
    mesh = ring(176, 96)
    body = Solid(mesh, fixed(mesh), SolidSettings(order=1), name="ring")
    print(f"{len(mesh.tets):,} tetrahedra, {len(body.mesh.vertices):,} vertices of surface")
    results: list[json_report.Result] = []
    with threadpool_limits(limits=1):
        asyncio.run(_serve(body, args, results))
    json_report.write(args, results)


async def _serve(body: Solid, args: argparse.Namespace, results: list[json_report.Result]) -> None:
    worker = ColumnWorker(body)
    server = CohapticServer(body, ServerSettings(port=0))
    url = await server.start()
    with ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory())
        people = _people(url, args, folder)
        prefer_this_process(SERVER_PRIORITY)
        worker.start()
        ticking = asyncio.create_task(server.run(worker.pump))
        try:
            while len(server.room.members) < args.users:
                await asyncio.sleep(0.5)
            await asyncio.sleep(WARM_UP)
            _report_warm_up(server, results)
            await _minutes(server, args, results)
        finally:
            for person in people:
                person.terminate()
            ticking.cancel()
            await asyncio.gather(ticking, return_exceptions=True)
            worker.stop()
            for person in people:
                person.wait()


async def _minutes(
    server: CohapticServer, args: argparse.Namespace, results: list[json_report.Result]
) -> None:
    missed: list[int] = []
    for minute in range(args.minutes):
        meters = server.meters = TickMeters()
        start = server.clock.now()
        await asyncio.sleep(args.minute)
        seconds = server.clock.now() - start
        missed.append(meters.missed)
        rate = (meters.ticks - meters.left_out) / seconds
        p50, p99 = meters.cost.quantile(0.5), meters.cost.quantile(0.99)
        print(
            f"minute {minute + 1}: {meters.missed} of {meters.ticks} ticks missed,"
            f" {meters.left_out} of them left out, {rate:.1f} ticks/s; a tick took {1e3 * p50:.1f}"
            f" ms in the median, {1e3 * p99:.1f} ms at the 99th percentile",
            flush=True,
        )
        results.append(
            {
                "minute": minute + 1,
                "ticks": meters.ticks,
                "missed": meters.missed,
                "left_out": meters.left_out,
                "ticks_per_s": rate,
                "tick_p50_s": p50,
                "tick_p99_s": p99,
            }
        )
    print(f"median minute: {sorted(missed)[len(missed) // 2]} missed")


def _report_warm_up(server: CohapticServer, results: list[json_report.Result]) -> None:
    meters = server.meters
    print(
        f"warm-up, not counted below: {meters.missed} of {meters.ticks} ticks missed; the longest"
        f" took {1e3 * meters.cost.largest:.0f} ms",
        flush=True,
    )
    results.append(
        {
            "phase": "warm-up",
            "ticks": meters.ticks,
            "missed": meters.missed,
            "left_out": meters.left_out,
            "tick_largest_s": meters.cost.largest,
        }
    )


def _people(url: str, args: argparse.Namespace, folder: str) -> list[subprocess.Popen[bytes]]:
    if args.whole:
        return [_touch(url, i, args, folder) for i in range(args.users)]
    how = ["--geometry", args.geometry, "--speed", str(args.speed)]
    light = str(Path(__file__).with_name("light_users.py"))
    return [
        subprocess.Popen(
            [sys.executable, light, url, str(args.users), *how], stdout=subprocess.DEVNULL
        )
    ]


def _touch(url: str, i: int, args: argparse.Namespace, folder: str) -> subprocess.Popen[bytes]:
    angle = 2.0 * math.pi * i / args.users
    place = (f"{RING * math.cos(angle):.5f}", f"{RING * math.sin(angle):.5f}", f"{TUBE:.5f}")
    command = [sys.executable, "-m", "cohaptic", "touch", url, "--name", f"user{i}"]
    command += ["--at", *place, "--inward", "0", "0", "-1", "--geometry", args.geometry]
    command += ["--loop-hz", str(args.loop_hz), "--rhythm-s", str(args.rhythm_s)]
    with open(f"{folder}/user{i}.txt", "wb") as words:
        return subprocess.Popen(command, stdout=words, stderr=subprocess.STDOUT)


if __name__ == "__main__":
    main()
