"""The processes of users and spectators for `spectators.py`, on the real protocol."""

from __future__ import annotations

import asyncio
import math
import time
from dataclasses import dataclass, field
from multiprocessing.connection import Connection as Pipe
from multiprocessing.synchronize import Event

from websockets.asyncio.client import ClientConnection, connect
from websockets.typing import Subprotocol

from cohaptic.clock import SystemClock
from cohaptic.protocol.ack import Ack
from cohaptic.protocol.contact_sample import ContactSample
from cohaptic.protocol.fields import FrameKind
from cohaptic.protocol.messages import Hello, encode_control
from cohaptic.protocol.patch import Patch
from cohaptic.protocol.rest_mesh import MAX_BYTES
from cohaptic.protocol.version import PROTOCOL_VERSION, SUBPROTOCOL
from cohaptic.protocol.watch_messages import EncodingName, Watch
from cohaptic.runtime.transport import WEBSOCKET_OPTIONS, tune

PERIOD = 1.0 / 60.0  # s


@dataclass
class Lateness:
    """Lateness of the patches of one user.

    Args:
        patches: Arrival of each patch after its tick [s].
        gaps: Deviation of each interval between patches from the simulation period [s].
        last: Arrival of the newest patch [s].
    """

    patches: list[float] = field(default_factory=list[float])
    gaps: list[float] = field(default_factory=list[float])
    last: float = math.nan

    def add(self, patch: Patch, now: float) -> None:
        """Count a patch that arrived at `now`, on the clock of its time stamp [s]."""
        self.patches.append(now - patch.t_server)
        if not math.isnan(self.last):
            self.gaps.append(abs(now - self.last - PERIOD))
        self.last = now


def hand(tick: int, user: int) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Probe [m] and force [N] of a user who presses and slides."""
    angle = math.pi * user + 0.4 * math.sin(0.05 * tick + user)
    x, y, force = math.cos(angle), math.sin(angle), 3.0 + 2.0 * math.sin(0.1 * tick + user)
    return (0.09 * x, 0.09 * y, 0.0), (force * x, force * y, 0.0)


async def join(url: str, name: str) -> ClientConnection:
    """Join as a user; returns the connection after the welcome."""
    options = WEBSOCKET_OPTIONS
    ws = await connect(url, subprotocols=[Subprotocol(SUBPROTOCOL)], proxy=None, **options)
    tune(ws.transport.get_extra_info("socket"))
    await ws.send(encode_control(Hello(protocol=PROTOCOL_VERSION, name=name, geometry="sphere")))
    await ws.recv()
    return ws


async def touching(url: str, name: str, user: int, clock: SystemClock, into: Lateness) -> None:
    """One user, until cancelled; adds its patches to `into`."""
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
    """The process of the users: on `True` it clears its records, on `False` it sends them."""

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
    """The process of the spectators, who are connected while `go` is set."""

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
