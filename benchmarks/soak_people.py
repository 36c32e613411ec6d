"""People of `soak.py`: users on real sockets who come, go, stall, vanish, and some who do harm."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import math
import random
from dataclasses import dataclass

from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import InvalidHandshake, InvalidMessage, WebSocketException
from websockets.typing import Subprotocol

from cohaptic.control.law import Law
from cohaptic.protocol.contact_sample import ContactSample
from cohaptic.protocol.messages import Bye, Hello, SetLaw, encode_control
from cohaptic.protocol.patch import Patch
from cohaptic.protocol.version import PROTOCOL_VERSION, SUBPROTOCOL
from cohaptic.protocol.watch_messages import Watch
from cohaptic.vec import scale

RADIUS, DEPTH = 0.1, 0.004  # m, of the balloon and of a press
PATIENCE = 10.0  # s for a welcome
_names = itertools.count()

# Those who do harm come from elsewhere, since an address that was closed for a flood waits.
HONEST, HOSTILE = "127.0.0.1", "127.0.0.9"


@dataclass
class Count:
    """What has happened, by kind."""

    joins: int = 0
    refused: int = 0
    lost: int = 0
    patches: int = 0
    hostile: int = 0
    stalls: int = 0
    laws: int = 0
    watched: int = 0


class Person:
    """One who presses in a room until it is told to go.

    Args:
        url: URL of the room.
        hz: Samples a second.
        count: What everybody adds to.
        seed: Seed of its place.
    """

    def __init__(self, url: str, hz: float, count: Count, seed: int) -> None:
        self.url, self._hz, self._count = url, hz, count
        draw = random.Random(seed)
        self._angle = draw.uniform(0.0, 2.0 * math.pi)
        self._name, self._key = f"p{next(_names)}", draw.randbytes(16).hex()
        self._stalled_until = 0.0
        self._vanishes = self._goes = False
        self._law: Law | None = None
        self.ticks = 0
        self.task = asyncio.ensure_future(self._live())

    def stall(self, seconds: float) -> None:
        """Neither read nor send for a while."""
        self._count.stalls += 1
        self._stalled_until = asyncio.get_running_loop().time() + seconds

    def choose(self, law: Law) -> None:
        """Ask for another law."""
        self._count.laws += 1
        self._law = law

    def go(self, *, politely: bool) -> None:
        """Leave, with a word or without."""
        self._goes, self._vanishes = True, not politely

    def come_back(self) -> None:
        """Vanish, and come again at once with the same name and secret."""
        self._vanishes = True

    async def _live(self) -> None:
        while not self._goes:
            try:
                await self._visit()
            except (OSError, WebSocketException, TimeoutError):
                self._count.lost += 1
            self._vanishes = False
            if not self._goes:
                await asyncio.sleep(0.5)

    async def _visit(self) -> None:
        async with connected(self.url, HONEST) as ws:
            hello = Hello(protocol=PROTOCOL_VERSION, name=self._name, key=self._key)
            await ws.send(encode_control(hello))
            async with asyncio.timeout(PATIENCE):
                answer = await ws.recv()
            if '"welcome"' not in str(answer):
                self._count.refused += 1
                return
            self._count.joins += 1
            reading = asyncio.ensure_future(self._read(ws))
            try:
                await self._send(ws, reading)
            finally:
                reading.cancel()
                with contextlib.suppress(asyncio.CancelledError, WebSocketException):
                    await reading

    async def _send(self, ws: ClientConnection, reading: asyncio.Future[None]) -> None:
        loop = asyncio.get_running_loop()
        seq = 0
        while not reading.done():
            if self._vanishes:
                ws.transport.abort()
                return
            if self._goes:
                await ws.send(encode_control(Bye()))
                return
            if loop.time() < self._stalled_until:
                ws.transport.pause_reading()
                await asyncio.sleep(self._stalled_until - loop.time())
                ws.transport.resume_reading()
            if self._law is not None:
                await ws.send(encode_control(SetLaw(law=self._law)))
                self._law = None
            seq += 1
            t = loop.time()
            out = (math.cos(self._angle), math.sin(self._angle), 0.0)
            level = 0.5 - 0.5 * math.cos(math.pi * t + self._angle)
            probe = scale(out, RADIUS - DEPTH * (0.5 + 0.5 * level))
            await ws.send(ContactSample(seq, self.ticks, t, probe, scale(out, level)).encode())
            await asyncio.sleep(1.0 / self._hz)

    async def _read(self, ws: ClientConnection) -> None:
        async for data in ws:
            if isinstance(data, bytes):
                self.ticks = Patch.decode(data).tick
                self._count.patches += 1


def connected(url: str, source: str) -> connect:
    """A connection from an address of this machine."""
    protocols = [Subprotocol(SUBPROTOCOL)]
    return connect(
        url, subprotocols=protocols, compression=None, proxy=None, max_size=None,
        local_addr=(source, 0), ping_interval=None, close_timeout=1.0,
    )  # fmt: skip


async def do_harm(url: str, count: Count, seed: int) -> None:
    """Rubbish and rules that are broken, over one connection, until the server ends it."""
    draw = random.Random(seed)
    count.hostile += 1
    good = ContactSample(1, 0, 0.0, (RADIUS, 0.0, 0.0), (1.0, 0.0, 0.0)).encode()
    hello = encode_control(Hello(protocol=PROTOCOL_VERSION, name=f"h{next(_names)}"))
    with contextlib.suppress(
        OSError, WebSocketException, InvalidHandshake, InvalidMessage, TimeoutError
    ):
        async with asyncio.timeout(PATIENCE), connected(url, HOSTILE) as ws:
            if draw.random() < 0.8:
                await ws.send(hello)
            for _ in range(draw.randrange(1, 400)):
                kind = draw.randrange(4)
                if kind == 0:
                    await ws.send(draw.randbytes(draw.randrange(300)))
                elif kind == 1:
                    at = draw.randrange(len(good))
                    await ws.send(good[:at] + draw.randbytes(draw.randrange(4)) + good[at:])
                elif kind == 2:
                    await ws.send(hello[: draw.randrange(len(hello))])
                else:
                    await ws.ping()


async def watch(url: str, count: Count, seconds: float) -> None:
    """Watch for a while, without a word about what was seen: a slow watcher."""
    with contextlib.suppress(OSError, WebSocketException, TimeoutError):
        async with asyncio.timeout(PATIENCE + seconds), connected(url, HONEST) as ws:
            await ws.send(encode_control(Watch(protocol=PROTOCOL_VERSION, encoding="forces")))
            count.watched += 1
            await asyncio.sleep(seconds)
