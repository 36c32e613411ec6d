"""The router on real sockets: whoever says nothing, or little by little."""

from __future__ import annotations

import asyncio
import contextlib
import socket
from collections.abc import AsyncGenerator

import pytest

from cohaptic.clock import SystemClock
from cohaptic_ops.rooms.router import Router
from cohaptic_server.guard.limits import Limits
from cohaptic_server.settings import ServerSettings
from cohaptic_server.shell import acceptor as module
from cohaptic_server.shell.acceptor import Acceptor
from cohaptic_server.shell.limiter import ConnectionLimiter
from cohaptic_server.shell.listener import open_acceptors
from tests.patience import PATIENCE

pytestmark = pytest.mark.live

LINE = b"GET /r/a HTTP/1.1\r\n\r\n"


class Taker:
    """A place.

    Attributes:
        seen: All that each connection has sent by then.
    """

    def __init__(self, *, willing: bool = True) -> None:
        self.willing = willing
        self.seen: list[bytes] = []

    def take(self, connection: socket.socket, source: str) -> bool:
        if self.willing:
            self.seen.append(connection.recv(4096, socket.MSG_PEEK))
        return self.willing


@contextlib.asynccontextmanager
async def opened(
    *places: Taker, limits: Limits | None = None
) -> AsyncGenerator[tuple[Acceptor, ConnectionLimiter, int]]:
    limiter = ConnectionLimiter(limits or Limits(), SystemClock())
    acceptors = await open_acceptors(ServerSettings(port=0), limiter)
    router = Router(
        acceptors, limiter, lambda target: places if target.startswith("/r/") else places[1:]
    )
    router.open()
    try:
        yield acceptors[0], limiter, acceptors[0].getsockname()[1]
    finally:
        router.close()


async def until(condition: object) -> None:
    assert callable(condition)
    async with asyncio.timeout(PATIENCE):
        while not condition():
            await asyncio.sleep(0.005)


def test_a_request_goes_whole_to_its_place_however_slowly_its_line_comes() -> None:
    async def main() -> None:
        taker = Taker()
        async with opened(taker) as (acceptor, limiter, port):
            _, writer = await asyncio.open_connection("127.0.0.1", port)
            for at in range(len(LINE)):
                assert taker.seen == []
                writer.write(LINE[at : at + 1])
                await asyncio.sleep(0.002)
            await until(lambda: taker.seen)
            assert taker.seen == [LINE]
            assert (acceptor.silent, limiter.sources.open) == (0, 1)  # counted out by its place
            writer.close()

    asyncio.run(main())


def test_who_says_nothing_is_closed_at_the_deadline_and_who_goes_is_forgotten(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(module, "HEAD_TIMEOUT", 0.3)

    async def main() -> None:
        async with opened(Taker()) as (acceptor, limiter, port):
            silent, silent_writer = await asyncio.open_connection("127.0.0.1", port)
            half, half_writer = await asyncio.open_connection("127.0.0.1", port)
            half_writer.write(LINE[:8])
            _, gone = await asyncio.open_connection("127.0.0.1", port)
            await until(lambda: acceptor.silent == 3)
            gone.close()
            await until(lambda: acceptor.silent == 2)
            for reader in (silent, half):
                with contextlib.suppress(ConnectionError):
                    assert await asyncio.wait_for(reader.read(), PATIENCE) == b""
            assert (acceptor.silent, limiter.sources.open) == (0, 0)
            silent_writer.close()
            half_writer.close()

    asyncio.run(main())


def test_those_who_say_nothing_are_bounded_for_an_address() -> None:
    async def main() -> None:
        limits = Limits().changed(["open=5"])
        async with opened(Taker(), limits=limits) as (acceptor, limiter, port):
            ends = [await asyncio.open_connection("127.0.0.1", port) for _ in range(20)]
            await until(lambda: limiter.sources.refused == 15)
            assert acceptor.silent == 5
            for _, writer in ends:
                writer.close()
            await until(lambda: acceptor.silent == limiter.sources.open == 0)

    asyncio.run(main())
