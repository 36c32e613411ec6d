"""A server on real sockets, with one well-behaved user, for the tests of the shell."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
from collections.abc import AsyncGenerator, Coroutine, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed
from websockets.typing import Subprotocol

from cohaptic.protocol.messages import (
    ServerControl,
    Welcome,
    decode_server_control,
)
from cohaptic.protocol.patch import Patch
from cohaptic.protocol.version import SUBPROTOCOL
from cohaptic.vec import Vec3, norm
from cohaptic_server.bodies.body import Body
from cohaptic_server.settings import ServerSettings
from cohaptic_server.shell.limiter import Protection
from cohaptic_server.shell.server import CohapticServer
from tests.patience import PATIENCE
from tests.server.peers import hello_text, sample

SIMULATION_HZ = 200.0  # the fastest: more happens in a test of a tenth of a second
FAR: Vec3 = (0.0, 0.5, 0.0)  # m; nobody's neighbour
ZERO: Vec3 = (0.0, 0.0, 0.0)
REQUEST = (
    b"GET / HTTP/1.1\r\nHost: here\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
    b"Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n\r\n"
)

T = TypeVar("T")
names = (f"visitor{i}" for i in itertools.count())


@dataclass
class Client:
    """A user whose samples follow its patches.

    Attributes:
        ws: Its connection.
        news: Control messages so far.
        probe, force: Of its samples.
        seq: Of the newest of them.
        tick: Of the newest patch; 0 before the first.
    """

    ws: ClientConnection
    news: list[ServerControl] = field(default_factory=list[ServerControl])
    probe: Vec3 = FAR
    force: Vec3 = ZERO
    seq: int = 0
    tick: int = 0

    async def hear(self) -> Patch | ServerControl:
        """The next message from the server."""
        data = await self.ws.recv()
        if isinstance(data, bytes):
            return Patch.decode(data)
        self.news.append(decode_server_control(data))
        return self.news[-1]

    async def join(self, name: str) -> int:
        """Come in; the own number."""
        await self.ws.send(hello_text(name))
        answer = await self.hear()
        assert isinstance(answer, Welcome)
        return answer.user

    async def touch(self) -> None:
        self.seq += 1
        reported = sample(self.seq, self.probe, self.force)
        await self.ws.send(reported._replace(tick=self.tick).encode())

    async def play(self, patches: int) -> list[Patch]:
        """Take part until so many patches have come."""
        if not self.seq:
            await self.touch()
        found: list[Patch] = []
        while len(found) < patches:
            message = await self.hear()
            if isinstance(message, Patch):
                found.append(message)
                self.tick = message.tick
                await self.touch()
        return found

    async def end(self) -> tuple[int, str, list[Patch]]:
        """Listen until the server closes; its code and reason, and the patches until then."""
        found: list[Patch] = []
        with contextlib.suppress(ConnectionClosed):
            while True:
                message = await self.hear()
                if isinstance(message, Patch):
                    found.append(message)
        assert self.ws.close_code is not None
        return self.ws.close_code, self.ws.close_reason or "", found


@contextlib.asynccontextmanager
async def visit(
    url: str,
    subprotocols: Sequence[str] = (SUBPROTOCOL,),
    patience: float = PATIENCE,
    **options: Any,
) -> AsyncGenerator[Client]:
    offered = [Subprotocol(name) for name in subprotocols] or None
    async with (
        asyncio.timeout(patience),
        connect(url, subprotocols=offered, compression=None, proxy=None, **options) as ws,
    ):
        yield Client(ws)


@dataclass
class Served:
    """A server that ticks."""

    server: CohapticServer
    url: str
    ticking: asyncio.Task[None]

    async def stop(self) -> None:
        self.ticking.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await self.ticking


@contextlib.asynccontextmanager
async def serving(
    body: Body, max_users: int = 64, protection: Protection | None = None, **more: Any
) -> AsyncGenerator[Served]:
    settings = ServerSettings(port=0, simulation_hz=SIMULATION_HZ, max_users=max_users, **more)
    server = CohapticServer(body, settings, protection=protection)
    url = await server.start()
    served = Served(server, url, asyncio.ensure_future(server.run()))
    try:
        yield served
    finally:
        await served.stop()


@dataclass
class Stage:
    """A server, a user who presses and does nothing wrong, and the loop in which they live."""

    runner: asyncio.Runner
    server: CohapticServer
    url: str
    steady: Client

    def during(self, happening: Coroutine[Any, Any, T], patches: int = 12) -> T:
        """Let something happen; the steady user must not notice.

        Args:
            happening: What other clients do.
            patches: How many the steady user takes meanwhile.
        """
        return self.runner.run(self._during(happening, patches))

    async def _during(self, happening: Coroutine[Any, Any, T], patches: int) -> T:
        async with asyncio.timeout(PATIENCE):
            last = await self._settled()
            async with asyncio.TaskGroup() as both:
                result = both.create_task(happening)
                felt = both.create_task(self.steady.play(patches))
        assert norm(last.own_force) > 1.0
        for number, patch in enumerate(felt.result(), start=last.tick + 1):
            assert surface(patch) == surface(last)
            assert patch.tick == number
        return result.result()

    async def _settled(self) -> Patch:
        """A patch of now that is like the one before: no force still rises."""
        now = self.server.room.world.tick
        before, last = await self.steady.play(2)
        while last.tick <= now or surface(before) != surface(last):
            before, last = last, (await self.steady.play(1))[0]
        return last


def surface(patch: Patch) -> Patch:
    """What of a patch the hand feels."""
    return replace(patch, tick=1, seq=0, t_server=0.0, t_client=0.0, sample_wait=0.0)
