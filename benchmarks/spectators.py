"""What those who watch cost, and whether those who touch notice.

    python benchmarks/spectators.py [--spectators 50] [--rate 30] [--seconds 4] [--rounds 4]

First the parts: what a scene of a balloon in motion takes to encode, and how many bytes it has.
Then a real server with two users who press and slide, over loopback. Phases with and without
spectators take turns in one run. Users and spectators live in a process each: nobody who touches
shares an event loop with the server. The users note when each patch comes; the server's stamp says
when its tick was, and both read the same clock. Timings depend on the machine and its load; compare
within one run.
"""

from __future__ import annotations

import argparse
import asyncio
import functools
import math
import multiprocessing
import sys
import time
from dataclasses import dataclass, field
from multiprocessing.connection import Connection as Pipe
from multiprocessing.synchronize import Event

import numpy as np
from threadpoolctl import threadpool_limits
from websockets.asyncio.client import ClientConnection, connect
from websockets.typing import Subprotocol

from cohaptic.clock import SystemClock
from cohaptic.control.law import Law
from cohaptic.protocol.ack import Ack
from cohaptic.protocol.contact_sample import ContactSample
from cohaptic.protocol.frame import FrameKind
from cohaptic.protocol.messages import Hello, encode_control
from cohaptic.protocol.patch import Patch
from cohaptic.protocol.rest_mesh import MAX_BYTES
from cohaptic.protocol.traversal import Traversal
from cohaptic.protocol.version import PROTOCOL_VERSION, SUBPROTOCOL
from cohaptic.protocol.watch_messages import EncodingName, Watch
from cohaptic.runtime.transport import WEBSOCKET_OPTIONS, tune
from cohaptic_server.bodies.balloon.balloon import Balloon, BalloonSettings
from cohaptic_server.bodies.touched_body import TouchedBody
from cohaptic_server.http.green_functions import Superposition, encode_block
from cohaptic_server.room.watch.scene_encoder import SceneEncoder
from cohaptic_server.room.watch.user_records import displacement, records
from cohaptic_server.settings import ServerSettings
from cohaptic_server.shell.server import CohapticServer
from cohaptic_server.world.state import Touch, WorldState
from cohaptic_server.world.tick import advance

PERIOD = 1.0 / 60.0  # s
WARM_UP = 1.0  # s at the start of a phase that do not count


@dataclass
class Lateness:
    """When patches came, against the tick that made them [s]."""

    patches: list[float] = field(default_factory=list[float])
    gaps: list[float] = field(default_factory=list[float])
    last: float = math.nan

    def add(self, patch: Patch, now: float) -> None:
        """One has come at `now`, on the clock that stamped it."""
        self.patches.append(now - patch.t_server)
        if not math.isnan(self.last):
            self.gaps.append(abs(now - self.last - PERIOD))
        self.last = now


def hand(tick: int, user: int) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Probe and force of one who presses and slides."""
    angle = math.pi * user + 0.4 * math.sin(0.05 * tick + user)
    x, y, force = math.cos(angle), math.sin(angle), 3.0 + 2.0 * math.sin(0.1 * tick + user)
    return (0.09 * x, 0.09 * y, 0.0), (force * x, force * y, 0.0)


def parts(body: Balloon) -> None:
    """Print what the pieces of watching cost, two users in motion."""
    n = len(body.mesh.vertices)
    encoder = SceneEncoder(Traversal.of(n, body.mesh.faces), follows_records=True)
    source, world = Superposition(body), WorldState()
    see, full, light, sizes, block = (list[float]() for _ in range(5))
    sizes_light = list[int]()
    for tick in range(1, 301):
        touches = [
            Touch(
                user + 1, Law.PREDICTIVE, 1000.0, 10.0, *hand(tick, user), tick, tick - 1, 0.0, 0.0
            )
            for user in range(2)
        ]
        world, patches = advance(TouchedBody(body), world, touches, now=tick * PERIOD, dt=PERIOD)
        shape = displacement(world, n)
        start = time.perf_counter()
        encoder.see(tick, 0.0, records(world, patches), functools.partial(np.asarray, shape))
        see.append(time.perf_counter() - start)
        start = time.perf_counter()
        sizes.append(len(encoder.frame(surface=True)))
        full.append(time.perf_counter() - start)
        start = time.perf_counter()
        sizes_light.append(len(encoder.frame(surface=False)))
        light.append(time.perf_counter() - start)
        start = time.perf_counter()
        encode_block(source.green(tick))
        block.append(time.perf_counter() - start)
    print(f"\n{n} vertices, two users, {len(see)} ticks\n")
    print("| | median | 99th percentile |\n|---|---|---|")
    print(
        f"| frame with the surface | {np.median(sizes):.0f} B | {np.quantile(sizes, 0.99):.0f} B |"
    )
    print(f"| frame of forces | {np.median(sizes_light):.0f} B | {max(sizes_light)} B |")
    for name, values in (
        ("records, and whether they are news", see),
        ("encode with the surface", full),
        ("encode forces", light),
        ("a block of Green's functions", block),
    ):
        low, high = 1e3 * np.median(values), 1e3 * np.quantile(values, 0.99)
        print(f"| {name} | {low:.3f} ms | {high:.3f} ms |")


async def join(url: str, name: str) -> ClientConnection:
    """A connection that touches."""
    options = WEBSOCKET_OPTIONS
    ws = await connect(url, subprotocols=[Subprotocol(SUBPROTOCOL)], proxy=None, **options)
    tune(ws.transport.get_extra_info("socket"))
    await ws.send(encode_control(Hello(protocol=PROTOCOL_VERSION, name=name, geometry="sphere")))
    await ws.recv()
    return ws


async def touching(url: str, name: str, user: int, clock: SystemClock, into: Lateness) -> None:
    """One user until cancelled; what it notes goes into `into`."""
    ws = await join(url, name)
    seq, newest = 0, 0

    async def speak() -> None:
        nonlocal seq
        while True:
            seq += 1
            probe, force = hand(seq, user)
            sample = ContactSample(seq, newest, clock.now(), probe, force)
            await ws.send(sample.encode())
            await asyncio.sleep(PERIOD)

    speaking = asyncio.ensure_future(speak())
    try:
        async for data in ws:
            if isinstance(data, bytes):
                now = clock.now()
                patch = Patch.decode(data)
                newest = patch.tick
                into.add(patch, now)
    finally:
        speaking.cancel()


def hands(url: str, origin: float, pipe: Pipe) -> None:
    """The process of those who touch: on `True` notes begin anew, on `False` it says them."""

    async def play() -> None:
        clock, noted = SystemClock(origin), [Lateness(), Lateness()]
        users = [
            asyncio.ensure_future(touching(url, f"hand{i}", i, clock, noted[i])) for i in range(2)
        ]
        while True:
            await asyncio.sleep(0.02)
            if not pipe.poll():
                continue
            try:
                if pipe.recv():
                    for mine in noted:
                        mine.patches, mine.gaps, mine.last = [], [], math.nan
                else:
                    pipe.send(noted)
            except EOFError:
                break
        for task in users:
            task.cancel()
        await asyncio.gather(*users, return_exceptions=True)

    asyncio.run(play())


def spectators(
    url: str, count: int, rate: float, encoding: EncodingName, go: Event, ready: Event, end: Event
) -> None:
    """The process of those who watch: between `go` and its absence they are there."""

    async def watch(frames: list[int]) -> None:
        async with connect(
            url, subprotocols=[Subprotocol(SUBPROTOCOL)], proxy=None, max_size=MAX_BYTES,
            compression=None,
        ) as ws:  # fmt: skip
            first = Watch(protocol=PROTOCOL_VERSION, encoding=encoding, rate=rate)
            await ws.send(encode_control(first))
            async for data in ws:
                if isinstance(data, bytes) and data[1] == FrameKind.SCENE:
                    frames[0] += 1
                    await ws.send(Ack(int.from_bytes(data[4:8], "little")).encode())

    async def phases() -> None:
        while not end.is_set():
            if not go.is_set():
                await asyncio.sleep(0.02)
                continue
            frames = [0]
            watching = [asyncio.ensure_future(watch(frames)) for _ in range(count)]
            while frames[0] < 2 * count and not end.is_set():
                await asyncio.sleep(0.02)
            frames[0], start = 0, time.perf_counter()
            ready.set()
            while go.is_set() and not end.is_set():
                await asyncio.sleep(0.02)
            each = frames[0] / count / (time.perf_counter() - start)
            print(f"  each of {count} got {each:.1f} frames/s", flush=True)
            for task in watching:
                task.cancel()
            await asyncio.gather(*watching, return_exceptions=True)

    asyncio.run(phases())


async def race(body: Balloon, options: argparse.Namespace) -> None:
    """Alternate phases without and with spectators; print both."""
    server = CohapticServer(body, ServerSettings(port=0))
    url = await server.start()
    serving = asyncio.ensure_future(server.run())
    context = multiprocessing.get_context("spawn")
    go, ready, end = context.Event(), context.Event(), context.Event()
    crowd = context.Process(
        target=spectators,
        args=(url, options.spectators, options.rate, options.encoding, go, ready, end),
    )
    crowd.start()
    ours, theirs = context.Pipe()
    touchers = context.Process(target=hands, args=(url, server.clock.origin, theirs))
    touchers.start()
    theirs.close()
    noted: dict[bool, list[Lateness]] = {False: [], True: []}
    busy = {False: 0.0, True: 0.0}
    while len(server.room.members) < 2:
        await asyncio.sleep(0.05)
    for phase in range(2 * options.rounds):
        watched = phase % 2 == 1
        if watched:
            go.set()
            while not ready.is_set():
                await asyncio.sleep(0.02)
        await asyncio.sleep(WARM_UP)
        ours.send(True)
        busy[watched] -= time.process_time()
        await asyncio.sleep(options.seconds)
        busy[watched] += time.process_time()
        ours.send(False)
        while not ours.poll():
            await asyncio.sleep(0.01)
        noted[watched] += ours.recv()
        go.clear()
        ready.clear()
        await asyncio.sleep(0.3)
    end.set()
    ours.close()
    serving.cancel()
    await asyncio.gather(serving, return_exceptions=True)
    crowd.join(10.0)
    touchers.join(10.0)
    report(noted, server)
    idle, full = (busy[watched] / (options.rounds * options.seconds) for watched in (False, True))
    print(f"the server was busy {idle:.0%} of the time, with spectators {full:.0%}")


def report(noted: dict[bool, list[Lateness]], server: CohapticServer) -> None:
    """Print when patches came, with and without those who watch."""
    print("\n| | after its tick p50 | p99 | off its time p50 | p99 | patches |")
    print("|---|---|---|---|---|---|")
    worst: dict[bool, float] = {}
    for watched, name in ((False, "nobody watches"), (True, "spectators")):
        late = np.concatenate([mine.patches for mine in noted[watched]])
        gaps = np.concatenate([mine.gaps for mine in noted[watched]])
        worst[watched] = float(np.quantile(gaps, 0.99))
        after = float(np.quantile(late, 0.99))
        print(
            f"| {name} | {1e3 * np.median(late):.2f} ms | {1e3 * after:.2f} ms"
            f" | {1e3 * np.median(gaps):.2f} ms | {1e3 * worst[watched]:.2f} ms | {len(late)} |"
        )
    print(
        f"\noff its time, 99th percentile: {1e3 * (worst[True] - worst[False]):+.2f} ms with"
        f" spectators, {worst[True] / worst[False]:.2f} times"
        f"\na tick took {1e3 * server.tick_cost.quantile(0.5):.2f} ms in the median, those who"
        f" watched {1e3 * server.watch_cost.quantile(0.5):.2f} ms more"
    )


def main() -> None:
    """Print tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--spectators", type=int, default=50)
    parser.add_argument("--rate", type=float, default=30.0, help="frames per second")
    parser.add_argument("--encoding", choices=("frames", "forces"), default="frames")
    parser.add_argument("--seconds", type=float, default=4.0, help="of a phase that count")
    parser.add_argument("--rounds", type=int, default=4, help="phases of each kind")
    parser.add_argument("--subdivisions", type=int, default=4, help="4 gives 2,562 vertices")
    options = parser.parse_args()
    sys.setswitchinterval(5e-4)
    print("building the balloon", file=sys.stderr)
    body = Balloon(BalloonSettings(subdivisions=options.subdivisions))
    with threadpool_limits(limits=1):
        parts(body)
        asyncio.run(race(body, options))


if __name__ == "__main__":
    main()
