"""The delay on an event loop, and connections to servers of all kinds on loopback."""

from __future__ import annotations

import asyncio
import contextlib
import socket
from collections.abc import AsyncGenerator, Awaitable, Callable, Coroutine
from contextlib import asynccontextmanager
from typing import Any

import pytest
from websockets.asyncio.server import ServerConnection, serve
from websockets.typing import Subprotocol

from cohaptic.clock import SystemClock
from cohaptic.errors import ServerLost
from cohaptic.protocol.version import SUBPROTOCOL
from cohaptic.simulated.delay_line import LinkSettings
from cohaptic_client.network.link import Data, Delayed, Link
from tests.patience import PATIENCE

pytestmark = pytest.mark.live

CLOCK = SystemClock()
NOW = LinkSettings()
SLOW = LinkSettings(delay=0.02, jitter=0.01, seed=1)  # short, but longer than loopback takes
ROUNDING = 1e-6  # s; two readings of one clock, days from its origin

Handler = Callable[[ServerConnection], Awaitable[None]]
Answer = Callable[[asyncio.StreamReader, asyncio.StreamWriter], Awaitable[None]]


def play(work: Coroutine[Any, Any, None]) -> None:
    asyncio.run(asyncio.wait_for(work, PATIENCE))


# Delayed


@pytest.mark.parametrize("setting", [NOW, SLOW])
def test_messages_come_in_order_and_none_before_its_delay(setting: LinkSettings) -> None:
    async def work() -> None:
        came = list[tuple[int, float]]()
        line = Delayed(setting, CLOCK, lambda data: came.append((int(data), CLOCK.now())))
        pushed = list[float]()
        for number in range(40):
            pushed.append(CLOCK.now())
            line.push(str(number))
            await asyncio.sleep(0.001 * (number % 3))
        while len(came) < len(pushed):
            await asyncio.sleep(0.005)
        assert [number for number, _ in came] == list(range(40))
        assert all(
            at - start >= setting.delay - ROUNDING
            for (_, at), start in zip(came, pushed, strict=True)
        )

    play(work())


def test_without_a_delay_a_message_is_there_before_push_returns() -> None:
    async def work() -> None:
        came = list[Data]()
        line = Delayed(NOW, CLOCK, came.append)
        line.push(b"\x01")
        assert came == [b"\x01"]

    play(work())


def test_what_is_in_flight_is_forgotten_on_cancel() -> None:
    async def work() -> None:
        came = list[Data]()
        line = Delayed(SLOW, CLOCK, came.append)
        line.push("never")
        line.cancel()
        await asyncio.sleep(2 * (SLOW.delay + SLOW.jitter))
        assert came == []

    play(work())


# Opening


@pytest.mark.parametrize(
    "url",
    [
        "",
        "nonsense",
        "127.0.0.1:8765",
        "http://127.0.0.1:8765",
        "ws://",
        "ws://127.0.0.1:99999",
        "ws://127.0.0.1:port",
        "ws://127.0.0.1:-1",
        "ws://[::1",
        "ws://.:8765",
        f"ws://{'x' * 70}.invalid",
        "ws://\udcff:8765",
    ],
)
def test_what_is_no_address_is_called_that(url: str) -> None:
    assert sentence_of(url) == f"{url}: not an address; expected ws://HOST:PORT"


def sentence_of(url: str) -> str:
    """Message when a link to `url` cannot be opened."""

    async def work() -> None:
        link = Link(url, CLOCK, NOW, NOW)
        try:
            await link.open()
        finally:
            await link.close()

    with pytest.raises(ServerLost) as caught:
        play(work())
    return str(caught.value)


def test_where_nobody_listens_a_sentence_says_how_to_start_a_server() -> None:
    with socket.socket() as reserved:
        reserved.bind(("127.0.0.1", 0))  # and never listens
        url = f"ws://127.0.0.1:{reserved.getsockname()[1]}"
        assert sentence_of(url) == f"{url}: no server answers; start one with: cohaptic serve"


async def say_not_found(_: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    writer.write(b"HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\n\r\n")


async def say_full(_: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    writer.write(b"HTTP/1.1 503 Service Unavailable\r\nContent-Length: 9\r\n\r\nno\x07 room\n")


async def say_something_else(_: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    writer.write(b"220 mail.invalid ESMTP\r\n")


async def hang_up(_: asyncio.StreamReader, __: asyncio.StreamWriter) -> None:
    pass


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (say_not_found, "HTTP 404"),
        (say_something_else, "HTTP"),
        (hang_up, "HTTP"),
    ],
)
def test_a_server_of_another_kind_is_called_that(answer: Answer, words: str) -> None:
    reported = answered_by(answer)
    assert reported.startswith("not a cohaptic server (")
    assert words in reported
    assert "\n" not in reported


def test_a_server_that_takes_nobody_now_says_why() -> None:
    assert answered_by(say_full) == "the server says: no? room"


def answered_by(answer: Answer) -> str:
    """Message when a server answers a link so, without the URL."""
    reported = list[str]()

    async def work() -> None:
        async def handle(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            await reader.readuntil(b"\r\n\r\n")
            await answer(reader, writer)
            writer.close()
            await writer.wait_closed()

        async with await asyncio.start_server(handle, "127.0.0.1", 0) as server:
            url = f"ws://127.0.0.1:{server.sockets[0].getsockname()[1]}"
            with pytest.raises(ServerLost) as caught:
                await Link(url, CLOCK, NOW, NOW).open()
            reported.append(str(caught.value).removeprefix(f"{url}: "))

    play(work())
    return reported[0]


# Talking


@asynccontextmanager
async def linked(
    handler: Handler, up: LinkSettings = NOW, down: LinkSettings = NOW
) -> AsyncGenerator[Link]:
    """A link to a server of our kind that runs `handler`."""
    protocols = [Subprotocol(SUBPROTOCOL)]
    async with serve(handler, "127.0.0.1", 0, subprotocols=protocols, max_size=None) as server:
        port = next(iter(server.sockets)).getsockname()[1]
        link = Link(f"ws://127.0.0.1:{port}", CLOCK, up, down)
        await link.open()
        try:
            yield link
        finally:
            await link.close()
            await link.close()


MESSAGES: list[Data] = ["hello", b"\x01\x02", b"", "later", b"\x03" * 88]


async def echo_then_close(ws: ServerConnection) -> None:
    for _ in MESSAGES:
        await ws.send(await ws.recv())
    await ws.close(4503, "the server stops")


@pytest.mark.parametrize("up", [NOW, SLOW])
@pytest.mark.parametrize("down", [NOW, SLOW])
def test_all_is_said_and_heard_in_order_to_the_last_word_then_why_it_ended(
    up: LinkSettings, down: LinkSettings
) -> None:
    async def work() -> None:
        async with linked(echo_then_close, up, down) as link:
            start, heard = CLOCK.now(), list[Data]()
            for message in MESSAGES:
                link.send(message)
            assert await link.receive(heard.append) == "the server stops"
            assert heard == MESSAGES
            assert CLOCK.now() - start >= up.delay + down.delay - ROUNDING

    play(work())


def test_a_name_with_several_addresses_is_reached_though_the_first_does_not_answer(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """As that of several machines, of which one has vanished."""

    async def work() -> None:
        with contextlib.ExitStack() as stack:
            deaf = stack.enter_context(socket.create_server(("127.0.0.1", 0), backlog=0))
            for _ in range(2):  # nobody takes these; the kernel does not answer a third
                one = stack.enter_context(socket.socket())
                one.setblocking(False)
                one.connect_ex(deaf.getsockname())
            async with serve(
                echo_then_close, "127.0.0.1", 0, subprotocols=[Subprotocol(SUBPROTOCOL)]
            ) as server:
                port = next(iter(server.sockets)).getsockname()[1]
                kind = (socket.AF_INET, socket.SOCK_STREAM, socket.IPPROTO_TCP, "")
                found = [(*kind, deaf.getsockname()), (*kind, ("127.0.0.1", port))]

                def resolve(*_: object, **__: object) -> list[tuple[object, ...]]:
                    return list[tuple[object, ...]](found)

                monkeypatch.setattr(socket, "getaddrinfo", resolve)
                link = Link("ws://cohaptic.invalid:8765", CLOCK, NOW, NOW)
                await link.open()
                await link.close()

    play(work())


async def break_off(ws: ServerConnection) -> None:
    ws.transport.abort()


async def close_without_a_word(ws: ServerConnection) -> None:
    await ws.close()


@pytest.mark.parametrize("end", [break_off, close_without_a_word])
def test_a_connection_that_ends_without_a_word_has_a_reason_too(end: Handler) -> None:
    async def work() -> None:
        async with linked(end) as link:
            assert await link.receive(lambda _: None) == "the connection was lost"

    play(work())


@pytest.mark.parametrize("down", [NOW, SLOW])
def test_what_a_listener_raises_ends_the_conversation(down: LinkSettings) -> None:
    """Also from a timer, where an exception would get lost."""

    class Unwanted(Exception):
        pass

    async def talk(ws: ServerConnection) -> None:
        for number in range(20):
            await ws.send(str(number))
        await ws.wait_closed()

    async def work() -> None:
        async with linked(talk, down=down) as link:

            def listen(data: Data) -> None:
                if data == "3":
                    raise Unwanted

            with pytest.raises(Unwanted):
                await link.receive(listen)

    play(work())


def test_samples_give_way_while_older_data_is_not_out_and_texts_never_do() -> None:
    texts = ["x" * 4_000_000, "y" * 4_000_000]  # more than the kernel's buffers hold
    got = list[Data]()
    listen, drained = asyncio.Event(), asyncio.Event()

    async def late(ws: ServerConnection) -> None:
        await listen.wait()
        async for data in ws:
            got.append(data)
            if data == texts[-1]:
                drained.set()

    async def work() -> None:
        async with linked(late) as link:
            for text in texts:
                link.send(text)
                link.send(b"old")
            listen.set()
            await drained.wait()
            link.send(b"new")
            while got[-1] != b"new":
                await asyncio.sleep(0.001)
        assert got == [*texts, b"new"]

    play(work())


# Receiving


@pytest.mark.parametrize("setting", [NOW, SLOW])
def test_messages_come_whole_and_in_order_also_in_fragments(setting: LinkSettings) -> None:
    """A fragmented one goes the library's way, and everything behind it follows there."""
    sent: list[Data | list[str]] = ["one", b"two", ["thr", "ee"], b"four", "five"]

    async def speak(connection: ServerConnection) -> None:
        for message in sent:
            await connection.send(message)
        await connection.close(reason="enough")

    async def work() -> None:
        came = list[Data]()
        async with serve(speak, "127.0.0.1", 0, subprotocols=[Subprotocol(SUBPROTOCOL)]) as server:
            port = server.sockets[0].getsockname()[1]
            link = Link(f"ws://127.0.0.1:{port}", CLOCK, NOW, setting)
            await link.open()
            assert await link.receive(came.append) == "enough"
            await link.close()
        assert came == ["one", b"two", "three", b"four", "five"]

    play(work())
