"""Whoever asks for too much is told and closed, on real sockets; the one who touches feels nothing.

What a flood costs in ticks is measured in `tests/system/test_floods.py`, beside a server process.
"""

from __future__ import annotations

import asyncio
import contextlib
import socket

import pytest
from websockets.frames import Frame, Opcode

from cohaptic.clock import SystemClock, thread_time
from cohaptic.control.law import Law
from cohaptic.errors import CloseCode
from cohaptic.protocol.messages import Error, SetLaw, UserJoined, Welcome, encode_control
from cohaptic.protocol.websocket_frames import make_frame
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.guard.limits import Budget, Limits
from cohaptic_server.shell import acceptor
from cohaptic_server.shell.acceptor import KERNEL_BUFFER
from cohaptic_server.shell.limiter import ConnectionLimiter
from tests.patience import PATIENCE
from tests.server.peers import hello_text, sample
from tests.server.shell.stage import FAR, REQUEST, ZERO, Stage, names, serving, visit

pytestmark = pytest.mark.live

KEY = b"abcd"
PINGS = Frame(Opcode.PING, b"x" * 100).serialize(mask=True) * 100
PONGS = Frame(Opcode.PONG, b"").serialize(mask=True) * 100


def samples(first: int) -> bytes:
    """Of a minute, numbered from `first` on."""
    each = (sample(first + k, FAR, ZERO) for k in range(4000))
    return b"".join(make_frame(one.encode(), KEY) for one in each)


LAWS = make_frame(encode_control(SetLaw(law=Law.PI)), KEY) * 200
EMPTY = Frame(Opcode.TEXT, b"", fin=False).serialize(mask=True)
EMPTY += Frame(Opcode.CONT, b"", fin=False).serialize(mask=True) * 3000
WORDS = {
    "pings": "number of pings and pongs is 'too many: ",
    "pongs": "number of pings and pongs is 'too many: ",
    "samples": "number of samples is 'too many: ",
    "laws": "number of control messages is 'too many: ",
    "empty frames": "expected at most ",
}


@pytest.mark.parametrize(
    ("what", "flood"),
    list(zip(WORDS, (PINGS, PONGS, samples(1), LAWS, EMPTY), strict=True)),
    ids=list(WORDS),
)
def test_who_floods_is_told_value_and_limit_and_closed_and_nobody_else_notices(
    stage: Stage, what: str, flood: bytes
) -> None:
    async def offend() -> tuple[int, str, list[Error]]:
        async with visit(stage.url) as client:
            await client.join(next(names))
            client.ws.transport.write(flood)
            code, reason, _ = await client.end()
            return code, reason, [news for news in client.news if isinstance(news, Error)]

    # As many as fit into the time until its connection is cut.
    code, reason, reported = stage.during(offend(), patches=100)
    assert code == CloseCode.TOO_MANY.value
    assert WORDS[what] in reason
    assert [error.message for error in reported] == [reason]
    assert "at most" in reason


async def raw(url: str) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
    return await asyncio.open_connection("127.0.0.1", int(url.rpartition(":")[2]))


async def answer(url: str, request: bytes = b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n") -> bytes:
    """All that a server answers."""
    reader, writer = await raw(url)
    writer.write(request)
    try:
        return await reader.read()
    except ConnectionResetError:
        return b""
    finally:
        writer.close()


def test_an_address_that_was_closed_for_floods_waits_and_who_is_inside_stays(
    small_balloon: Balloon,
) -> None:
    async def offend() -> tuple[bytes, bytes]:
        limits = Limits(dismissals=Budget(0.1, 2.0))
        async with asyncio.timeout(PATIENCE), serving(small_balloon, limits=limits) as served:
            async with visit(served.url) as honest:
                await honest.join("honest")
                for number in range(2):
                    async with visit(served.url) as client:
                        await client.join(f"flood{number}")
                        client.ws.transport.write(PINGS)
                        assert (await client.end())[0] == CloseCode.TOO_MANY.value
                refused = await answer(served.url)
                await honest.play(3)
                served.server.clock.origin += 10.0
                return refused, await answer(served.url)

    refused, later = asyncio.run(offend())
    assert refused.startswith(b"HTTP/1.1 429 ")
    assert b"Retry-After: 1" in refused
    assert b"connections that asked for too much: at most 0.1 a second and 2 at once" in refused
    assert later.startswith(b"HTTP/1.1 200 ")


def test_what_piled_up_while_the_server_stood_still_is_no_flood(small_balloon: Balloon) -> None:
    """As when its machine slept for 14 s; but what follows is one, also at once."""

    async def come() -> tuple[int, int]:
        async with asyncio.timeout(PATIENCE), serving(small_balloon) as served:
            async with visit(served.url) as guest:
                await guest.join("guest")
                await guest.play(3)
                served.server.clock.origin += 14.0
                guest.ws.transport.write(samples(100))
                guest.seq = 4100
                await guest.play(3)
                spent = sum(served.server.limiter.traffic.spent.values())
                assert served.server.limiter.pardon(served.server.clock.now(), thread_time()) == 1
                guest.ws.transport.write(samples(5000))
                code, _, _ = await guest.end()
                return spent, code

    assert asyncio.run(come()) == (0, CloseCode.TOO_MANY.value)


def test_a_server_that_floods_keep_busy_pardons_none() -> None:
    """It computes all the time, while one that was suspended does not; and no pardon is renewed."""
    clock = SystemClock()
    busy, suspended = ConnectionLimiter(Limits(), clock), ConnectionLimiter(Limits(), clock)
    for limiter in (busy, suspended):
        assert limiter.pardon(1e6, 0.0) == 0  # no tick is expected yet
        limiter.tick(100.0, 5.0)
        assert limiter.pardon(101.9, 5.1) == 0
    assert busy.pardon(114.0, 18.0) == 0
    busy.tick(114.0, 18.0)
    assert busy.pardon(114.1, 18.1) == 0
    assert [suspended.pardon(now, 5.2) for now in (114.0, 114.1)] == [1, 1]
    suspended.tick(114.2, 5.3)
    assert [suspended.pardon(now, 5.3) for now in (115.9, 116.1)] == [1, 0]
    assert suspended.pardon(130.0, 5.4) == 0  # again, too soon
    suspended.tick(170.0, 5.5)
    assert suspended.pardon(190.0, 5.6) == 2


def test_connections_that_never_ask_are_bounded_told_and_cut(
    small_balloon: Balloon, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(acceptor, "HEAD_TIMEOUT", 1.0)

    async def come() -> tuple[list[bytes], int, bytes]:
        limits = Limits(open=20)
        async with asyncio.timeout(PATIENCE), serving(small_balloon, limits=limits) as served:
            silent = [await raw(served.url) for _ in range(100)]
            open_then = served.server.limiter.sources.open
            ends = await asyncio.gather(*(reader.read() for reader, _ in silent))
            for _, writer in silent:
                writer.close()
            while served.server.limiter.sources.open:
                await asyncio.sleep(0)
            return ends, open_then, await answer(served.url)

    ends, open_then, later = asyncio.run(come())
    assert open_then <= 20
    assert sum(b"open connections from one address: at most 20" in end for end in ends) == 80
    assert later.startswith(b"HTTP/1.1 200 ")


def test_joins_beyond_their_budget_are_refused_and_are_no_news_to_others(
    small_balloon: Balloon,
) -> None:
    async def come() -> tuple[list[int], list[type]]:
        limits = Limits(joins=Budget(0.001, 3.0))
        async with asyncio.timeout(PATIENCE), serving(small_balloon, limits=limits) as served:
            async with visit(served.url) as honest:
                await honest.join("honest")
                codes: list[int] = []
                guests = contextlib.AsyncExitStack()
                for number in range(5):
                    client = await guests.enter_async_context(visit(served.url))
                    await client.ws.send(hello_text(f"guest{number}"))
                    await client.hear()
                    if isinstance(client.news[-1], Error):
                        codes.append((await client.end())[0])
                await honest.play(2)
                await guests.aclose()
                return codes, [type(news) for news in honest.news]

    codes, heard = asyncio.run(come())
    assert codes == [CloseCode.TOO_MANY.value] * 3
    assert heard == [Welcome, UserJoined, UserJoined]


def test_what_is_not_read_is_bounded_for_an_address(small_balloon: Balloon) -> None:
    async def ask() -> tuple[bytes, bytes]:
        limits = Limits(unread=1)
        async with asyncio.timeout(PATIENCE), serving(small_balloon, limits=limits) as served:
            web, lazy = served.server.web, await raw(served.url)
            web.serve(small_balloon, lambda vertex: bytes(4 * 2**20))
            green = f"GET /v1/models/{web.model}/green/0 HTTP/1.1\r\nHost: localhost\r\n\r\n"
            lazy[1].write(green.encode())
            while not served.server.limiter.sources.unread:
                await asyncio.sleep(0)
            refused = await answer(served.url)
            lazy[1].close()
            while served.server.limiter.sources.unread:
                await asyncio.sleep(0)
            return refused, await answer(served.url)

    refused, later = asyncio.run(ask())
    assert refused.startswith(b"HTTP/1.1 429 ")
    assert b"4,194,304 bytes for 127.0.0.1 are not read yet; the limit is 1" in refused
    assert later.startswith(b"HTTP/1.1 200 ")


def test_the_kernel_keeps_little_for_a_connection(stage: Stage) -> None:
    """Linux takes twice as much for its own records, and says so."""

    async def look() -> set[int]:
        async with visit(stage.url):
            found: set[int] = set()
            for connection in stage.server.connections:
                end = connection.ws.transport.get_extra_info("socket")
                for option in (socket.SO_SNDBUF, socket.SO_RCVBUF):
                    found.add(end.getsockopt(socket.SOL_SOCKET, option))
            return found

    assert max(stage.during(look())) <= 2 * KERNEL_BUFFER


def test_a_request_that_is_still_coming_is_not_heard_for_ever(stage: Stage) -> None:
    """Its bytes, one at a time, have the budget of samples."""

    async def trickle() -> bytes:
        reader, writer = await raw(stage.url)
        writer.write(REQUEST[:-2] + b"X: " + b"y" * 10_000)
        try:
            return await reader.read()
        finally:
            writer.close()

    assert b"101" not in stage.during(trickle())
