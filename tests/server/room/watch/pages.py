"""Pages and clients at a served room, over real sockets."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import math
import socket
from collections.abc import AsyncGenerator
from dataclasses import dataclass, field

from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed
from websockets.typing import Subprotocol

from cohaptic.protocol.ack import Ack
from cohaptic.protocol.messages import encode_control
from cohaptic.protocol.rest_mesh import MAX_BYTES, RestMesh
from cohaptic.protocol.scene import Scene
from cohaptic.protocol.traversal import Traversal
from cohaptic.protocol.version import PROTOCOL_VERSION, SUBPROTOCOL
from cohaptic.protocol.watch_messages import (
    EncodingName,
    Watch,
    WatchControl,
    Watching,
    decode_watch_control,
)
from tests.patience import PATIENCE
from tests.server.shell.stage import Client, Served, visit


@dataclass
class Page:
    """One who watches."""

    ws: ClientConnection
    watching: Watching
    mesh: RestMesh
    traversal: Traversal
    news: list[WatchControl] = field(default_factory=list[WatchControl])

    async def hear(self) -> Scene | WatchControl:
        data = await self.ws.recv()
        if isinstance(data, bytes):
            return Scene.decode(data, self.traversal)
        self.news.append(decode_watch_control(data))
        return self.news[-1]

    async def scene(self, wants: int = 0) -> Scene:
        """The next scene, acknowledged."""
        while True:
            message = await self.hear()
            if isinstance(message, Scene):
                await self.ws.send(Ack(message.tick, wants).encode())
                return message

    async def report(self, kind: type[WatchControl]) -> WatchControl:
        """The next news of a kind; scenes meanwhile are acknowledged."""
        while True:
            message = await self.hear()
            if isinstance(message, Scene):
                await self.ws.send(Ack(message.tick).encode())
            elif isinstance(message, kind):
                return message

    async def end(self) -> tuple[int, str]:
        with contextlib.suppress(ConnectionClosed):
            while True:
                await self.hear()
        return self.ws.close_code or 0, self.ws.close_reason or ""


@contextlib.asynccontextmanager
async def watching(
    url: str,
    encoding: EncodingName = "frames",
    rate: float = 60.0,
    sock: socket.socket | None = None,
) -> AsyncGenerator[Page]:
    async with (
        asyncio.timeout(AGES),
        connect(
            url,
            subprotocols=[Subprotocol(SUBPROTOCOL)],
            compression=None,
            proxy=None,
            max_size=MAX_BYTES,
            sock=sock,
        ) as ws,
    ):
        watch = Watch(protocol=PROTOCOL_VERSION, encoding=encoding, rate=rate)
        await ws.send(encode_control(watch))
        first, second = await ws.recv(), await ws.recv()
        assert isinstance(first, str)
        assert isinstance(second, bytes)
        answer, mesh = decode_watch_control(first), RestMesh.decode(second)
        assert isinstance(answer, Watching)
        yield Page(ws, answer, mesh, Traversal.of(len(mesh.vertices), mesh.faces))


@contextlib.asynccontextmanager
async def pressing(served: Served, name: str = "ann") -> AsyncGenerator[Client]:
    """A user who presses, and goes on while others do something."""
    async with visit(served.url) as client:
        client.probe, client.force = (0.09, 0.0, 0.0), (2.0, 0.0, 0.0)
        await client.join(name)
        await client.touch()

        async def play() -> None:
            for step in itertools.count():
                client.force = (2.0 + math.sin(0.3 * step), 0.0, 0.0)
                await client.play(1)

        playing = asyncio.ensure_future(play())
        try:
            yield client
        finally:
            playing.cancel()
            with contextlib.suppress(asyncio.CancelledError, ConnectionClosed):
                await playing


AGES = 2.0 * PATIENCE  # s; for a test that moves the clock
