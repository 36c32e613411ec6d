"""A server behind TLS that can be reached through an HTTP proxy alone."""

from __future__ import annotations

import asyncio
import contextlib
import ssl
from pathlib import Path

import pytest
from websockets.asyncio.server import ServerConnection, serve
from websockets.typing import Subprotocol

from cohaptic.clock import SystemClock
from cohaptic.errors import ServerLost
from cohaptic.protocol.version import SUBPROTOCOL
from cohaptic.simulated.delay_line import LinkSettings
from cohaptic_client.network.link import Data, Link
from tests.patience import PATIENCE
from tests.server.credentials.pairs import write_authority, write_pair

pytestmark = pytest.mark.live

HOST = "haptics.example"  # which this machine cannot resolve


class Proxy:
    """Passes bytes on to a port of this machine, whatever host is asked for, or refuses."""

    def __init__(self, port: int, *, refuses: bool = False) -> None:
        self.asked: list[str] = []
        self._port, self._refuses = port, refuses

    async def __call__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        with contextlib.closing(writer):
            request = (await reader.readuntil(b"\r\n\r\n")).decode()
            self.asked.append(request.splitlines()[0])
            if self._refuses:
                writer.write(b"HTTP/1.1 403 Forbidden\r\n\r\n")
                await writer.drain()
                return
            inner_reader, inner_writer = await asyncio.open_connection("127.0.0.1", self._port)
            writer.write(b"HTTP/1.1 200 OK\r\n\r\n")
            with contextlib.closing(inner_writer), contextlib.suppress(ConnectionError):
                await asyncio.gather(_pass(reader, inner_writer), _pass(inner_reader, writer))


async def _pass(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    while data := await reader.read(4096):
        writer.write(data)
        await writer.drain()
    writer.close()


@pytest.mark.parametrize("refuses", [False, True])
def test_a_public_server_with_tls_is_reached_through_the_proxy(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, *, refuses: bool
) -> None:
    for name in ("NO_PROXY", "no_proxy", "https_proxy"):
        monkeypatch.delenv(name, raising=False)
    authority = write_authority(tmp_path)
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(*write_pair(tmp_path, HOST))

    async def greet(ws: ServerConnection) -> None:
        await ws.send("hello")
        await ws.wait_closed()

    async def work() -> None:
        async with serve(
            greet, "127.0.0.1", 0, ssl=context, subprotocols=[Subprotocol(SUBPROTOCOL)]
        ) as server:
            port = server.sockets[0].getsockname()[1]
            proxy = Proxy(port, refuses=refuses)
            async with await asyncio.start_server(proxy, "127.0.0.1", 0) as passing:
                at = passing.sockets[0].getsockname()[1]
                monkeypatch.setenv("HTTPS_PROXY", f"http://127.0.0.1:{at}")
                now = LinkSettings()
                link = Link(f"wss://{HOST}:{port}", SystemClock(), now, now, str(authority))
                if refuses:
                    with pytest.raises(ServerLost, match=rf"through the proxy 127.0.0.1:{at}.*403"):
                        await link.open()
                else:
                    await link.open()
                    came: asyncio.Future[Data] = asyncio.get_running_loop().create_future()
                    receiving = asyncio.ensure_future(link.receive(came.set_result))
                    assert await came == "hello"
                    await link.close()
                    await receiving
            assert proxy.asked == [f"CONNECT {HOST}:{port} HTTP/1.1"]

    asyncio.run(asyncio.wait_for(work(), PATIENCE))
