"""Messages that pass by the library stay in order with those that do not, from any server."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from itertools import pairwise

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from websockets.asyncio.client import connect
from websockets.asyncio.server import ServerConnection, serve
from websockets.exceptions import ConnectionClosed, InvalidHandshake
from websockets.frames import Close, Frame, Opcode

from cohaptic.protocol.websocket_frames import KEY, make_frame
from cohaptic.runtime.direct_loop import DirectLoop
from cohaptic_client.network import wire
from cohaptic_client.network.wire import LONGEST, Wire
from tests.examples_of_laws import examples
from tests.patience import PATIENCE

pytestmark = pytest.mark.live

BYE = Frame(Opcode.CLOSE, Close(1000, "").serialize()).serialize(mask=False)
PING = Frame(Opcode.PING, b"there?").serialize(mask=False)
Message = str | bytes


def framed(message: Message, fragments: int) -> bytes:
    """A message of a server, in one frame or several."""
    data = message.encode() if isinstance(message, str) else message
    kind = Opcode.TEXT if isinstance(message, str) else Opcode.BINARY
    size = -(-len(data) // fragments)
    parts = [data[at : at + size] for at in range(0, len(data), size)]
    return PING.join(
        Frame(Opcode.CONT if k else kind, part, fin=k == len(parts) - 1).serialize(mask=False)
        for k, part in enumerate(parts)
    )


async def heard(chunks: list[bytes]) -> tuple[list[Message], int]:
    """What is heard of a server that writes these pieces once the connection is open.

    Returns:
        Its messages, in order, and how many of them passed by the library.
    """
    messages: list[Message] = []
    direct = 0

    async def speak(ws: ServerConnection) -> None:
        await ws.recv()
        for chunk in chunks:
            ws.transport.write(chunk)
            await asyncio.sleep(0)
        await ws.wait_closed()

    def deliver(data: bytes) -> None:
        nonlocal direct
        direct += 1
        messages.append(data)

    async with serve(speak, "127.0.0.1", 0, compression=None, close_timeout=1) as server:
        port = next(iter(server.sockets)).getsockname()[1]
        url = f"ws://127.0.0.1:{port}"
        async with connect(
            url, create_connection=Wire, max_size=20_000, proxy=None, close_timeout=1
        ) as ws:
            assert isinstance(ws, Wire)
            loop = asyncio.get_running_loop()
            if isinstance(loop, DirectLoop):
                assert loop.read_directly(ws.transport, ws.data_received)
            ws.deliver = deliver
            ws.write("speak")
            try:
                while True:
                    messages.append(await ws.recv())
                    ws.taken()
            except ConnectionClosed:
                pass
    return messages, direct


def play(chunks: list[bytes], *, direct_loop: bool) -> tuple[list[Message], int]:
    factory = DirectLoop if direct_loop else None
    with asyncio.Runner(loop_factory=factory) as runner:
        return runner.run(asyncio.wait_for(heard(chunks), PATIENCE))


@settings(max_examples=examples(40), deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    st.lists(
        st.tuples(
            st.text(min_size=1, max_size=20)
            | st.binary(min_size=1, max_size=1200)
            | st.integers(1, 3 * LONGEST).map(bytes),
            st.integers(1, 3),
        ),
        max_size=10,
    ),
    st.lists(st.integers(0, 30_000), max_size=6),
    st.booleans(),
)
def test_messages_are_heard_once_and_in_order_however_they_come(
    sent: list[tuple[Message, int]], cuts: list[int], direct_loop: bool
) -> None:
    data = b"".join(framed(*message) for message in sent) + BYE
    places = [0, *sorted(cut % len(data) for cut in cuts), len(data)]
    messages, _ = play([data[a:b] for a, b in pairwise(places)], direct_loop=direct_loop)
    assert messages == [message for message, _ in sent]


@pytest.mark.parametrize("direct_loop", [False, True])
def test_patches_pass_by_the_library(direct_loop: bool) -> None:
    patches: list[Message] = [bytes([k]) * 800 for k in range(20)]
    messages, direct = play([*(framed(p, 1) for p in patches), BYE], direct_loop=direct_loop)
    assert messages == patches
    assert direct == len(patches)


@pytest.mark.parametrize("direct_loop", [False, True])
@pytest.mark.parametrize(
    "bad",
    [
        Frame(Opcode.BINARY, b"x").serialize(mask=True),
        Frame(Opcode.BINARY, bytes(20_001)).serialize(mask=False),
        b"\x82\xff" + b"\xff" * 40,
        Frame(Opcode.TEXT, b"x", fin=False).serialize(mask=False)
        + Frame(Opcode.BINARY, b"x").serialize(mask=False),
        b"\xc2\x01x",
        Frame(Opcode.TEXT, b"\xff\xff").serialize(mask=False),
    ],
    ids=["masked", "long", "endless", "within another", "compressed", "no text"],
)
def test_what_breaks_the_rules_of_frames_ends_the_connection(bad: bytes, direct_loop: bool) -> None:
    messages, direct = play([bad, framed(b"after", 1)], direct_loop=direct_loop)
    assert (messages, direct) == ([], 0)


def test_the_body_of_a_refusal_is_not_cut() -> None:
    """It may look like the beginning of a long frame."""

    async def refuse(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        await reader.readuntil(b"\r\n\r\n")
        writer.write(b"HTTP/1.1 403 Forbidden\r\nContent-Length: 5\r\n\r\n\x82\x7e\x01\x00x")
        await reader.read()
        writer.close()

    async def work() -> None:
        async with await asyncio.start_server(refuse, "127.0.0.1", 0) as server:
            port = server.sockets[0].getsockname()[1]
            with pytest.raises(InvalidHandshake, match="HTTP 403"):
                await connect(f"ws://127.0.0.1:{port}", create_connection=Wire, proxy=None)

    asyncio.run(asyncio.wait_for(work(), PATIENCE))


def test_what_comes_with_the_answer_to_the_handshake_is_heard(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A server may write its first frames in the same segment."""
    receive = Wire.data_received

    def more(ws: Wire, data: bytes) -> None:
        answer = data.startswith(b"HTTP/1.1 101")
        receive(ws, data + framed(b"early", 1) if answer else data)

    monkeypatch.setattr(Wire, "data_received", more)

    async def work() -> None:
        async with connected() as ws:
            assert await ws.recv() == b"early"

    asyncio.run(asyncio.wait_for(work(), PATIENCE))


def test_no_masking_key_is_used_twice(monkeypatch: pytest.MonkeyPatch) -> None:
    keys: list[bytes] = []

    def note(message: Message, key: bytes) -> bytes:
        keys.append(key)
        return make_frame(message, key)

    monkeypatch.setattr(wire, "make_frame", note)

    async def work() -> None:
        async with connected() as ws:
            for _ in range(700):
                ws.write(bytes(52))

    asyncio.run(asyncio.wait_for(work(), PATIENCE))
    assert {len(key) for key in keys} == {KEY}
    assert len(keys) == 700
    assert len(set(keys)) > 697  # of 2^32: that two of them meet is one run in 17,000


def test_nothing_is_written_behind_the_farewell() -> None:
    got: list[Message] = []

    async def work() -> None:
        async with connected(got) as ws:
            ws.write("first")
            await ws.close()
            ws.write("late")

    asyncio.run(asyncio.wait_for(work(), PATIENCE))
    assert got == ["first"]


@asynccontextmanager
async def connected(got: list[Message] | None = None) -> AsyncGenerator[Wire]:
    """A connection to a server that only listens."""

    async def listen(ws: ServerConnection) -> None:
        async for message in ws:
            if got is not None:
                got.append(message)

    async with serve(listen, "127.0.0.1", 0) as server:
        port = next(iter(server.sockets)).getsockname()[1]
        url = f"ws://127.0.0.1:{port}"
        async with connect(url, create_connection=Wire, proxy=None) as ws:
            assert isinstance(ws, Wire)
            yield ws
