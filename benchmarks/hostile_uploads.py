"""Hostile files are brought to a server while a hand touches: missed ticks and memory, for each.

    python benchmarks/hostile_uploads.py [--only NAME ...] [--json FILE]

The server runs here, with its own meters; a simulated hand presses from one process, and a visitor
brings the files from another. Each row has the ticks while that happened, how many of them were
missed, and the peak memory of the server and of the worker. `nothing` is the same without a visitor
and `prepared` a sound file up to its preparation, which is then cancelled. Beside the files of
`tests/server/upload/hostile.py` there are visitors who send a byte a second, who all come at once,
and who go in the middle.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import subprocess
import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Callable
from pathlib import Path
from typing import Any

from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

from cohaptic.clock import SystemClock
from cohaptic.protocol.messages import encode_control
from cohaptic.protocol.upload_messages import CHUNK, SUBPROTOCOL, BeginUpload, PrepareObject
from cohaptic.runtime.scheduling import SERVER_PRIORITY, prefer_this_process
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.cli.serve import SWITCH_INTERVAL
from cohaptic_server.room.pace import TickMeters
from cohaptic_server.settings import ServerSettings
from cohaptic_server.shell.exchange import ServedBody
from cohaptic_server.shell.server import CohapticServer
from cohaptic_server.shell.upload_desk import UploadDesk, take_uploads
from cohaptic_server.upload.process import ordinary_priority
from object_start import memory

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))  # for the files, which the tests have
from tests.server.upload.hostile import HOSTILE  # noqa: E402

QUIET = 20.0  # s without a visitor
CLOCK = SystemClock()


def open_desk(url: str) -> contextlib.AbstractContextManager[ClientConnection]:
    """A connection that may bring a file."""
    kinds = [Subprotocol(SUBPROTOCOL)]
    return connect(url, subprotocols=kinds, compression=None, proxy=None, max_size=2**22)


def begin(ws: ClientConnection, name: str, content: bytes, share: float = 1.0) -> None:
    """Send the file, or the first part of it."""
    ws.recv()
    ws.send(encode_control(BeginUpload(name=name, size=len(content))))
    for at in range(0, round(share * len(content)), CHUNK):
        ws.send(content[at : at + CHUNK])


def answer(ws: ClientConnection) -> str:
    """The last word of the server: what is in the file, or why not."""
    said = json.loads(ws.recv())
    return str(said.get("message") or f"examined, {said['triangles']:,} triangles")


def bring(url: str, name: str) -> str:
    """Bring one file, and hear what becomes of it."""
    with open_desk(url) as ws:
        begin(ws, name, HOSTILE[name]())
        return answer(ws)


def bring_slowly(url: str) -> str:
    """A byte a second, until the server has had enough."""
    with open_desk(url) as ws:
        ws.recv()
        ws.send(encode_control(BeginUpload(name="slow.stl", size=10**6)))
        while True:
            try:
                return str(json.loads(ws.recv(timeout=1.0))["message"])
            except TimeoutError:
                ws.send(b"1")


def bring_at_once(url: str) -> str:
    """Ten visitors with five million triangles each."""
    content = HOSTILE["five-million.ply"]()
    served = 0
    with contextlib.ExitStack() as all_of_them:
        for _ in range(10):
            with contextlib.suppress(ConnectionClosed):
                begin(all_of_them.enter_context(open_desk(url)), "many.ply", content, 0.9)
                served += 1
    return f"{served} of 10 could send"


def go_in_the_middle(url: str) -> str:
    """Thirty visitors, one after another, who are gone before the file is there."""
    content = HOSTILE["polygon.obj"]()
    for _ in range(30):
        with open_desk(url) as ws, contextlib.suppress(ConnectionClosed):
            begin(ws, "gone.obj", content, 0.1)  # the rest never comes
    return "30 went"


def prepare(url: str) -> str:
    """A sound file, prepared for half a minute and then left."""
    with open_desk(url) as ws:
        begin(ws, "organ.ply", (ROOT / "examples/organ.ply").read_bytes())
        said = answer(ws)
        ws.recv()
        ws.send(encode_control(PrepareObject(fix="z < 15%", young=6e3)))
        until = CLOCK.now() + 30.0
        while CLOCK.now() < until and json.loads(ws.recv())["phase"] != "storing":
            pass
    return f"{said}; prepared up to storing"


OTHERS: dict[str, Callable[[str], str]] = {
    "slow": bring_slowly,
    "ten at once": bring_at_once,
    "gone": go_in_the_middle,
    "prepared": prepare,
}


def send_visitor(url: str, name: str) -> str:
    """A visitor in a process of ordinary priority: it would inherit that of the tick's thread."""
    ordinary_priority()
    command = [sys.executable, __file__, "--visit", url, name]
    return subprocess.run(command, stdout=subprocess.PIPE, text=True, check=False).stdout.strip()


async def watch_worker(desk: UploadDesk, peak: list[int]) -> None:
    """Keep the largest memory of all workers in `peak[0]`."""
    while True:
        if desk.worker is not None:
            peak[0] = max(peak[0], memory(desk.worker.pid))
        await asyncio.sleep(0.1)


async def measure(options: Namespace) -> list[dict[str, Any]]:
    """Serve, and let the visitors come one after another."""
    body = Balloon()
    server = CohapticServer(body, ServerSettings(port=0, allow_upload=True))
    desk = take_uploads(server, ServedBody(body), 0.0)
    url = await server.start()
    ticking = asyncio.create_task(server.run())
    hand = subprocess.Popen(
        [sys.executable, "-m", "cohaptic", "touch", url, "--name", "hand", "--json-lines"],
        stdout=subprocess.DEVNULL,
    )
    rows: list[dict[str, Any]] = []
    try:
        while not server.room.patches:
            await asyncio.sleep(0.1)
        await asyncio.sleep(2.0)
        for name in ("nothing", *HOSTILE, *OTHERS):
            if options.only and name not in options.only:
                continue
            rows.append(await visit(server, desk, url, name))
            print(line(rows[-1]), flush=True)
    finally:
        hand.terminate()
        hand.wait()
        ticking.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await ticking
    return rows


async def visit(server: CohapticServer, desk: UploadDesk, url: str, name: str) -> dict[str, Any]:
    """One row."""
    server.meters, peak = TickMeters(), [0]
    watching = asyncio.create_task(watch_worker(desk, peak))
    started = CLOCK.now()
    said = ""
    if name == "nothing":
        await asyncio.sleep(QUIET)
    else:
        said = await asyncio.to_thread(send_visitor, url, name)
        while desk.busy:
            await asyncio.sleep(0.05)
    watching.cancel()
    return {
        "visitor": name,
        "seconds": CLOCK.now() - started,
        "ticks": server.meters.ticks,
        "missed": server.meters.missed,
        "server_peak_bytes": memory(os.getpid()),
        "worker_peak_bytes": peak[0],
        "said": said,
    }


def line(row: dict[str, Any]) -> str:
    """A row of the table."""
    return (
        f"| {row['visitor']} | {row['seconds']:.1f} s | {row['missed']} of {row['ticks']} |"
        f" {row['server_peak_bytes'] / 1e6:.0f} MB | {row['worker_peak_bytes'] / 1e6:.0f} MB |"
        f" {row['said'][:160]} |"
    )


def main() -> None:
    """Measure, or be the visitor."""
    parser = ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--only", nargs="*", help="these visitors alone")
    parser.add_argument("--json", type=Path, help="write the rows here")
    parser.add_argument("--visit", nargs=2, help="be this visitor: URL and name")
    options = parser.parse_args()
    if options.visit:
        url, name = options.visit
        print(bring(url, name) if name in HOSTILE else OTHERS[name](url))
        return
    prefer_this_process(SERVER_PRIORITY)
    sys.setswitchinterval(SWITCH_INTERVAL)
    print("| visitor | time | missed ticks | server | worker | the answer |")
    print("| --- | --- | --- | --- | --- | --- |", flush=True)
    rows = asyncio.run(measure(options))
    if options.json:
        options.json.write_text(json.dumps(rows, indent=1))


if __name__ == "__main__":
    main()
