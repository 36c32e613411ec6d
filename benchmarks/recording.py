"""Cost of recording a room: ticks of a server with and without, and what is in the file.

    python benchmarks/recording.py [--minutes 10] [--users 8] [--beside 1] [--json FILE]

`--users` people press a balloon in a rhythm and send their rows at 1 kHz; their loops run elsewhere
(`row_users.py`), since eight loops take more than two cores. A minute or so (`--beside`) goes by
without a recording before and after one of `--minutes`. Ratios are of one run. A tick's cost ends
when its patches are written; the recording's own time on the event loop, after that, is counted
beside it.
"""

from __future__ import annotations

import argparse
import asyncio
import subprocess
import sys
import tempfile
import time
from collections.abc import Generator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

import json_report
from cohaptic.runtime.scheduling import SERVER_PRIORITY, prefer_this_process
from cohaptic.sessions.entries import Rows, RowsLost
from cohaptic.sessions.reader import Outline, read_entries
from cohaptic.status.row import ROW
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.cli.serving import SWITCH_INTERVAL
from cohaptic_server.room.tick_schedule import TickMeters
from cohaptic_server.settings import ServerSettings
from cohaptic_server.shell.server import CohapticServer

SETTLING = 5.0  # s after the last user has come


def main() -> None:
    """Print the three spans, and what is in the file."""
    parser = json_report.parser(__doc__)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--beside", type=float, default=1.0, help="minutes without, twice")
    parser.add_argument("--users", type=int, default=8)
    args = parser.parse_args()
    results: list[json_report.Result] = []
    with tempfile.TemporaryDirectory() as folder, threadpool_limits(limits=1):
        path = Path(folder) / "session.mcap"
        asyncio.run(_measure(args, path, results))
        _tell_file(args, path, results)
    json_report.write(args, results)


async def _measure(args: argparse.Namespace, path: Path, results: list[json_report.Result]) -> None:
    server = CohapticServer(Balloon(), ServerSettings(port=0))
    url = await server.start()
    people = _people(url, args.users)
    prefer_this_process(SERVER_PRIORITY)
    sys.setswitchinterval(SWITCH_INTERVAL)
    ticking = asyncio.create_task(server.run())
    try:
        while len(server.room.members) < args.users:
            await asyncio.sleep(0.5)
        await asyncio.sleep(SETTLING)
        await _span(server, "without", args.beside, results)
        await server.recordings.begin(str(path))
        await _span(server, "recorded", args.minutes, results)
        await server.recordings.end()
        await _span(server, "without", args.beside, results)
    finally:
        people.terminate()
        ticking.cancel()
        await asyncio.gather(ticking, return_exceptions=True)
        people.wait()


async def _span(
    server: CohapticServer, name: str, minutes: float, results: list[json_report.Result]
) -> None:
    """Let time go by, and report its ticks."""
    server.meters = TickMeters()
    recording = server.recordings.current
    with ExitStack() as stack:
        ticks = stack.enter_context(_timed(server, "tick"))
        after = [0.0] if recording is None else stack.enter_context(_timed(recording, "after_tick"))
        await asyncio.sleep(60.0 * minutes)
    cost = np.quantile(ticks, (0.5, 0.99))
    then = float(np.median(after))
    print(
        f"{name:9} {len(ticks)} ticks, {server.meters.missed} missed; a tick took"
        f" {1e3 * cost[0]:.2f} ms in the median, {1e3 * cost[1]:.2f} ms at the 99th percentile;"
        f" then the recording {1e3 * then:.2f} ms",
        flush=True,
    )
    results.append(
        {
            "span": name,
            "ticks": len(ticks),
            "missed": server.meters.missed,
            "tick_p50_s": float(cost[0]),
            "tick_p99_s": float(cost[1]),
            "after_p50_s": then,
        }
    )


@contextmanager
def _timed(of: object, method: str) -> Generator[list[float]]:
    """Yield the times that a method takes meanwhile [s], as the server's meters have steps."""
    inner, spent = getattr(of, method), list[float]()

    def timed(*arguments: object) -> object:
        begun = time.perf_counter()
        answer = inner(*arguments)
        spent.append(time.perf_counter() - begun)
        return answer

    setattr(of, method, timed)
    try:
        yield spent
    finally:
        delattr(of, method)


def _tell_file(args: argparse.Namespace, path: Path, results: list[json_report.Result]) -> None:
    outline = Outline.of(path)
    size, minutes = path.stat().st_size, outline.seconds / 60.0
    rows = lost = 0
    for entry in read_entries(path, only=(Rows, RowsLost)):
        if isinstance(entry, Rows):
            rows += len(entry.block) // ROW.size
        elif isinstance(entry, RowsLost):
            lost += entry.count
    each = size / 1e6 / args.users / minutes
    print(
        f"{size / 1e6:.1f} MB, {each:.2f} MB for each minute and user; {rows:,} rows,"
        f" {rows / args.users / outline.seconds:.0f} a second and user, {lost} lost;"
        f" {outline.left_out} entries left out"
    )
    results.append(
        {"bytes": size, "seconds": outline.seconds, "rows": rows, "rows_lost": lost,
         "left_out": outline.left_out, "mb_per_user_minute": each}
    )  # fmt: skip


def _people(url: str, users: int) -> subprocess.Popen[bytes]:
    script = str(Path(__file__).with_name("row_users.py"))
    return subprocess.Popen([sys.executable, script, url, str(users)], stdout=subprocess.DEVNULL)


if __name__ == "__main__":
    main()
