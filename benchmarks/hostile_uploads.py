"""Does an upload cost the server a tick? Each is measured beside a load that is none.

    python benchmarks/hostile_uploads.py [--only NAME ...] [--rounds N] [--ordinary] [--json FILE]

A server and a simulated hand that presses run in processes of their own. In turn, N times, a
visitor brings a file (`upload_visitors.py`), and then, for as long, nobody does: an unrelated
process of the worker's priority, and one of the visitor's, take as much of the processor as the two
did. Each row has the ticks of both, how many were missed, how many a bare timer of the server's
priority missed meanwhile (which nothing in the server can cause), and the peak memory of server
and worker. The last row is the sum. `--ordinary` leaves the server without real-time priority, as
many people's systems do.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import resource
import select
import subprocess
import sys
import tempfile
import time
from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import IO, Any

from cohaptic.clock import SystemClock
from cohaptic.runtime.scheduling import SERVER_PRIORITY, prefer_this_process
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.cli.serving import SWITCH_INTERVAL
from cohaptic_server.room.tick_schedule import TickMeters, is_missed, next_tick
from cohaptic_server.routes import Serving
from cohaptic_server.settings import ServerSettings
from cohaptic_server.shell.exchange import ServedBody
from cohaptic_server.shell.server import CohapticServer
from cohaptic_uploads.upload_desk import UploadDesk, take_uploads
from object_start import memory
from tick_waits import Waits
from upload_visitors import NAMES, file_of

PERIOD = 1.0 / 60.0  # s
CLOCK = SystemClock()
LOW_NICENESS = 10  # as a worker has
_WARM_UP = 2.0  # s


class Helper:
    """A process that is asked one line at a time, and answers with a line of JSON."""

    def __init__(self, *arguments: str) -> None:
        command = [sys.executable, __file__, *arguments]
        self.process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def tell(self, line: str) -> None:
        """Ask, and do not wait."""
        stream: IO[str] | None = self.process.stdin
        assert stream is not None
        stream.write(line + "\n")
        stream.flush()

    def hear(self) -> Any:
        """The next answer."""
        assert self.process.stdout is not None
        return json.loads(self.process.stdout.readline())

    def ask(self, line: str) -> Any:
        """Ask, and wait for the answer."""
        self.tell(line)
        return self.hear()

    def close(self) -> None:
        """End it."""
        self.process.kill()
        self.process.wait()


def children_used() -> float:
    """Processor time of the children that have ended and were waited for [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


async def be_server(*, ordinary: bool) -> None:
    """The server: says its address, then for each line what was since the line before."""
    body = Balloon()
    server = CohapticServer(body, ServerSettings(port=0, allow_upload=True))
    desk = take_uploads(Serving(server, ServedBody(body)))
    url = await server.start()
    print(json.dumps(url), flush=True)
    if not ordinary:
        prefer_this_process(SERVER_PRIORITY)
    sys.setswitchinterval(SWITCH_INTERVAL)
    lines = asyncio.StreamReader()
    await asyncio.get_running_loop().connect_read_pipe(
        lambda: asyncio.StreamReaderProtocol(lines), sys.stdin
    )
    waits = Waits(server)
    ticking = asyncio.create_task(server.run(lambda _: waits.look()))
    peak = [0]
    watching = asyncio.create_task(watch_worker(desk, peak))
    used = children_used()
    while await lines.readline():
        while desk.busy:
            await asyncio.sleep(0.01)
        meters, now = server.meters, children_used()
        reported = {
            "ticks": meters.ticks,
            "missed": meters.missed,
            "worst_late": meters.late.quantile(1.0),
            "worst_cost": meters.cost.quantile(1.0),
            "worker_used": now - used,
            "worker_peak": peak[0],
            "server_peak": memory(os.getpid()),
            "waits": waits.reported,
        }
        print(json.dumps(reported), flush=True)
        waits.clear()
        server.meters, used, peak[0] = TickMeters(), now, 0
    watching.cancel()
    ticking.cancel()


async def watch_worker(desk: UploadDesk, peak: list[int]) -> None:
    """Keep the largest memory of a worker in `peak[0]`."""
    while True:
        if desk.worker is not None:
            peak[0] = max(peak[0], memory(desk.worker.pid))
        await asyncio.sleep(0.1)


def be_timer(*, ordinary: bool) -> None:
    """A bare timer of the server's period and priority: how often it woke a period late."""
    if not ordinary:
        prefer_this_process(SERVER_PRIORITY)
    ticks = missed = 0
    due = CLOCK.now()
    while True:
        due, left_out = next_tick(due, CLOCK.now(), PERIOD)
        while (wait := due - CLOCK.now()) > 0.0:
            if not select.select([sys.stdin], [], [], wait)[0]:
                continue
            if not sys.stdin.readline():
                return
            print(json.dumps({"ticks": ticks, "missed": missed}), flush=True)
            ticks = missed = 0
        ticks += 1 + left_out
        missed += left_out + is_missed(due, CLOCK.now(), PERIOD)


def measure(options: Namespace) -> list[dict[str, Any]]:
    """All rounds of all visitors."""
    ordinary = ["--ordinary"] if options.ordinary else []
    rows: list[dict[str, Any]] = []
    with tempfile.TemporaryDirectory(prefix="uploads-") as folder, contextlib.ExitStack() as ends:
        names = [name for name in NAMES if not options.only or name in options.only]
        for name in names:
            file_of(name, Path(folder))
        server = Helper("--be", "server", *ordinary)
        ends.callback(server.close)
        timer = Helper("--be", "timer", *ordinary)
        ends.callback(timer.close)
        url = server.hear()
        hand = subprocess.Popen(
            [sys.executable, "-m", "cohaptic", "touch", url, "--name", "hand", "--json-lines"],
            stdout=subprocess.DEVNULL,
        )
        ends.callback(hand.wait)
        ends.callback(hand.terminate)
        time.sleep(_WARM_UP)
        for _ in range(options.rounds):
            for name in names:
                rows.append(one_round(server, timer, url, name, folder))
                print(line(rows[-1]), flush=True)
    return rows


def one_round(server: Helper, timer: Helper, url: str, name: str, folder: str) -> dict[str, Any]:
    """A visitor, and then the load that is like it."""
    for helper in (server, timer):
        helper.ask("from now on")
    began, used = CLOCK.now(), children_used()
    visitor = str(Path(__file__).with_name("upload_visitors.py"))
    done = subprocess.run(
        [sys.executable, visitor, url, name, folder], stdout=subprocess.PIPE, text=True, check=False
    )
    with_upload, with_timer = server.ask("and?"), timer.ask("and?")
    seconds = CLOCK.now() - began
    worker_share = with_upload["worker_used"] / seconds
    visitor_share = (children_used() - used) / seconds
    loads = [
        start_load(fraction, seconds, niceness)
        for fraction, niceness in ((worker_share, LOW_NICENESS), (visitor_share, 0))
    ]
    for helper in (server, timer):
        helper.ask("from now on")
    for load in loads:
        load.wait()
    beside, beside_timer = server.ask("and?"), timer.ask("and?")
    return {
        "visitor": name,
        "seconds": seconds,
        "upload": with_upload,
        "upload_timer": with_timer,
        "load": beside,
        "load_timer": beside_timer,
        "worker_share": worker_share,
        "visitor_share": visitor_share,
        "said": done.stdout.strip(),
    }


def start_load(fraction: float, seconds: float, niceness: int) -> subprocess.Popen[str]:
    """A load that has begun."""
    script = str(Path(__file__).with_name("like_load.py"))
    command = [sys.executable, script, str(fraction), str(seconds), str(niceness)]
    load = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert load.stdout is not None
    load.stdout.readline()
    return load


def line(row: dict[str, Any]) -> str:
    """A row of the table."""
    up, load = row["upload"], row["load"]
    peaks = f"{up['server_peak'] / 1e6:.0f} MB | {up['worker_peak'] / 1e6:.0f} MB"
    return (
        f"| {row['visitor']} | {row['seconds']:.1f} s |"
        f" {up['missed']} of {up['ticks']} ({row['upload_timer']['missed']}) |"
        f" {load['missed']} of {load['ticks']} ({row['load_timer']['missed']}) | {peaks} |"
        f" {row['said'][:120]} |"
    )


def total(rows: list[dict[str, Any]]) -> str:
    """The sum of all rounds."""

    def both(kind: str) -> str:
        missed, ticks = (sum(row[kind][of] for row in rows) for of in ("missed", "ticks"))
        timer = sum(row[f"{kind}_timer"]["missed"] for row in rows)
        return f"{missed} of {ticks} ({timer})"

    seconds = sum(row["seconds"] for row in rows)
    return f"| all | {seconds:.0f} s | {both('upload')} | {both('load')} | | | |"


def main() -> None:
    """Measure, or be one of the processes."""
    parser = ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--only", nargs="*", help="these visitors alone")
    parser.add_argument("--rounds", type=int, default=1, help="how often")
    parser.add_argument("--ordinary", action="store_true", help="no real-time priority")
    parser.add_argument("--json", type=Path, help="write the rows here")
    parser.add_argument("--be", choices=["server", "timer"])
    options = parser.parse_args()
    if options.be == "server":
        asyncio.run(be_server(ordinary=options.ordinary))
    elif options.be == "timer":
        be_timer(ordinary=options.ordinary)
    else:
        print("| visitor | time | missed (timer) | a load like it | server | worker | answer |")
        print("| --- | --- | --- | --- | --- | --- | --- |", flush=True)
        rows = measure(options)
        print(total(rows))
        if options.json:
            options.json.write_text(json.dumps(rows, indent=1))


if __name__ == "__main__":
    main()
