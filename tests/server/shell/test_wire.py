"""Messages that pass by the library stay in order with those that do not."""

from __future__ import annotations

import asyncio
from itertools import pairwise

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from websockets.asyncio.server import ServerConnection, serve
from websockets.exceptions import ConnectionClosed
from websockets.frames import Close, Frame, Opcode

from cohaptic_server.shell.wire import MAX_INBOUND_BYTES, Wire, unmask
from tests.examples_of_laws import examples
from tests.server.shell.stage import REQUEST

pytestmark = pytest.mark.live

BYE = Frame(Opcode.CLOSE, Close(1000, "").serialize()).serialize(mask=True)

texts = st.text(min_size=1, max_size=20)
binaries = st.binary(min_size=1, max_size=200)


def framed(message: str | bytes, fragments: int) -> bytes:
    """A message of a client, in one frame or several."""
    data = message.encode() if isinstance(message, str) else message
    kind = Opcode.TEXT if isinstance(message, str) else Opcode.BINARY
    size = -(-len(data) // fragments)
    parts = [data[at : at + size] for at in range(0, len(data), size)]
    return b"".join(
        Frame(Opcode.CONT if k else kind, part, fin=k == len(parts) - 1).serialize(mask=True)
        for k, part in enumerate(parts)
    )


async def heard(chunks: list[bytes]) -> tuple[list[str | bytes], int]:
    """What is heard of a client who sends these pieces once the connection is open.

    Returns:
        Its messages, in order, and how many of them passed by the library.
    """
    messages: list[str | bytes] = []
    direct = 0
    ended = asyncio.Event()

    async def handle(ws: ServerConnection) -> None:
        assert isinstance(ws, Wire)

        def deliver(frame: bytes) -> None:
            nonlocal direct
            direct += 1
            messages.append(unmask(frame))

        ws.deliver = deliver
        try:
            while True:
                messages.append(await ws.recv())
                ws.taken()
        except ConnectionClosed:
            ended.set()

    async with serve(
        handle, "127.0.0.1", 0, compression=None, create_connection=Wire, max_size=MAX_INBOUND_BYTES
    ) as server:
        port = next(iter(server.sockets)).getsockname()[1]
        reader, writer = await asyncio.open_connection("127.0.0.1", port)
        writer.write(REQUEST[:40])
        await writer.drain()
        await asyncio.sleep(0)
        writer.write(REQUEST[40:])
        await reader.readuntil(b"\r\n\r\n")
        for chunk in chunks:
            writer.write(chunk)
            await writer.drain()
            await asyncio.sleep(0)
        async with asyncio.timeout(10.0):
            await reader.read()  # to the end, which the server writes first
            writer.close()
            await ended.wait()
    return messages, direct


@settings(max_examples=examples(25), deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    st.lists(st.tuples(texts | binaries, st.integers(1, 3)), max_size=10),
    st.lists(st.integers(0, 3000), max_size=6),
)
def test_messages_are_heard_once_and_in_order_however_they_come(
    sent: list[tuple[str | bytes, int]], cuts: list[int]
) -> None:
    data = b"".join(framed(*message) for message in sent) + BYE
    places = [0, *sorted(cut % len(data) for cut in cuts), len(data)]
    messages, _ = asyncio.run(heard([data[a:b] for a, b in pairwise(places)]))
    assert messages == [message for message, _ in sent]


def test_samples_of_a_client_that_waits_for_nothing_pass_by_the_library() -> None:
    samples = [bytes([k]) * 48 for k in range(20)]
    hello = framed("hello", 1)

    async def play() -> tuple[list[str | bytes], int]:
        return await heard([*(framed(s, 1) for s in samples), hello, BYE])

    messages, direct = asyncio.run(play())
    assert messages == [*samples, "hello"]
    assert direct > 0


@pytest.mark.parametrize(
    "bad",
    [
        Frame(Opcode.BINARY, b"x").serialize(mask=False),
        Frame(Opcode.BINARY, bytes(MAX_INBOUND_BYTES + 1)).serialize(mask=True),
        # A new message inside a fragmented one.
        Frame(Opcode.TEXT, b"x", fin=False).serialize(mask=True)
        + Frame(Opcode.BINARY, b"x").serialize(mask=True),
    ],
    ids=["bare", "long", "within another"],
)
def test_what_breaks_the_rules_of_frames_ends_the_connection(bad: bytes) -> None:
    messages, _ = asyncio.run(heard([bad, framed("after", 1)]))
    assert messages == []
