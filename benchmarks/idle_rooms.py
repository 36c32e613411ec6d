"""What rooms cost in which nobody is, and how much later the first touch of one of them is.

    python benchmarks/idle_rooms.py [--rooms 12] [--seconds 20] [--touches 10] [--json FILE]

One server with so many rooms of the balloon. After all have opened, and for `--seconds`, nobody is
there: told are the processor time of the rooms and of the router, and the memory of a room:
resident, its share (what processes have in common is divided among them) and what it has for
itself. Processor time is told whatever else the machine does. Then a hand comes to each of
`--touches` rooms that sleep, and as often to one that a watcher keeps awake, in turn: told is the
time from the first byte of the connection to the first patch. It fails where all rooms take more
than 3 % of a core with the router, or where a touch is 50 ms later in the median.
"""

from __future__ import annotations

import asyncio
import re
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

from websockets.asyncio.client import ClientConnection, connect
from websockets.typing import Subprotocol

import json_report
from cohaptic.control.law import Law
from cohaptic.protocol.contact_sample import ContactSample
from cohaptic.protocol.messages import Bye, Hello, encode_control
from cohaptic.protocol.patch import Patch
from cohaptic.protocol.version import PROTOCOL_VERSION, SUBPROTOCOL
from cohaptic.protocol.watch_messages import Watch
from load_rooms import Rooms

SETTLED = 3.0  # s after the last room has opened
MAX_PROCESSOR = 0.03  # of a core, for all
MAX_LATER = 0.05  # s
_KIB = 1024


def memory(pid: int) -> tuple[int, int, int]:
    """Resident, proportional and own memory of a process [bytes]."""
    text = Path(f"/proc/{pid}/smaps_rollup").read_text()
    found = dict(re.findall(r"^(Rss|Pss|Private_Dirty):\s+(\d+) kB", text, re.MULTILINE))
    resident, fraction, own = (_KIB * int(found[kind]) for kind in ("Rss", "Pss", "Private_Dirty"))
    return resident, fraction, own


def _connect(url: str) -> connect:
    return connect(url, subprotocols=[Subprotocol(SUBPROTOCOL)], compression=None, proxy=None)


async def _until_patch(ws: ClientConnection) -> None:
    while True:
        data = await ws.recv()
        if isinstance(data, bytes) and _is_patch(data):
            return


def _is_patch(data: bytes) -> bool:
    try:
        Patch.decode(data)
    except ValueError:
        return False
    return True


async def first_touch(url: str) -> float:
    """From the first byte of a connection to the first patch [s]."""
    begun = time.perf_counter()
    async with _connect(url) as ws:
        hello = Hello(protocol=PROTOCOL_VERSION, name="hand", law=Law.PREDICTIVE, max_force=5.0)
        await ws.send(encode_control(hello))
        await ws.recv()  # its welcome
        probe, force = (0.095, 0.0, 0.0), (1.0, 0.0, 0.0)
        sample = ContactSample(seq=1, tick=0, t_client=0.0, probe=probe, force=force)
        await ws.send(sample.encode())
        await _until_patch(ws)
        took = time.perf_counter() - begun
        await ws.send(encode_control(Bye()))
        await ws.wait_closed()
    return took


async def touches(urls: list[str], count: int) -> tuple[list[float], list[float]]:
    """First touches of rooms that sleep, and of one that is awake, in turn [s]."""
    asleep, awake = list[float](), list[float]()
    async with _connect(urls[0]) as watcher:
        await watcher.send(encode_control(Watch(protocol=PROTOCOL_VERSION)))
        drain = asyncio.ensure_future(_listen(watcher))
        await first_touch(urls[0])
        for i in range(count):
            asleep.append(await first_touch(urls[1 + i % (len(urls) - 1)]))
            awake.append(await first_touch(urls[0]))
        drain.cancel()
    return asleep, awake


async def _listen(ws: ClientConnection) -> None:
    async for _ in ws:
        pass


def main() -> None:
    """Print a table; exits with 1 where a bound does not hold."""
    parser = json_report.parser(__doc__)
    parser.add_argument("--rooms", type=int, default=12, help="at least 2")
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--touches", type=int, default=10)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        rooms = Rooms(Path(name), options.rooms, 1, _cores())
        try:
            time.sleep(SETTLED)
            before, begun = rooms.spent(), time.perf_counter()
            time.sleep(options.seconds)
            spent, over = rooms.spent(), time.perf_counter() - begun
            sizes = [memory(pid) for pid in rooms.pids]
            asleep, awake = asyncio.run(touches(rooms.urls, options.touches))
        finally:
            rooms.end()
    in_rooms, in_front = ((b - a) / over for a, b in zip(before, spent, strict=True))
    resident, fraction, own = (median(size[k] for size in sizes) for k in range(3))
    later = median(asleep) - median(awake)
    print(f"{options.rooms} rooms in which nobody is, {over:.0f} s:")
    print(
        f"  processor: {100 * in_rooms:.2f} % of a core in the rooms, "
        f"{100 * in_rooms / options.rooms:.3f} % in each; {100 * in_front:.2f} % in the router"
    )
    print(
        f"  memory of a room: {1e-6 * resident:.1f} MB resident,"
        f" {1e-6 * fraction:.1f} MB its share, {1e-6 * own:.1f} MB its own"
    )
    print(
        f"  first touch: {1e3 * median(asleep):.1f} ms asleep, {1e3 * median(awake):.1f} ms awake,"
        f" {1e3 * later:+.1f} ms; the longest {1e3 * max(asleep):.1f} and {1e3 * max(awake):.1f}"
    )
    json_report.write(
        options,
        [
            {
                "processor_rooms": in_rooms, "processor_router": in_front,
                "resident_bytes": resident, "proportional_bytes": fraction, "own_bytes": own,
                "first_touch_asleep_s": median(asleep), "first_touch_awake_s": median(awake),
                "later_s": later,
            }
        ],
    )  # fmt: skip
    if in_rooms + in_front > MAX_PROCESSOR or later > MAX_LATER:
        sys.exit("an empty room costs more than it may")


def _cores() -> set[int]:
    import os

    return os.sched_getaffinity(0)


if __name__ == "__main__":
    main()
