"""The loop serves a socket and a timer directly, and is asyncio's loop for everything else."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Callable, Coroutine
from typing import Any

import pytest

from cohaptic.runtime.direct_loop import DirectLoop

pytestmark = pytest.mark.alone


def play(work: Callable[[DirectLoop], Coroutine[Any, Any, None]]) -> list[dict[str, Any]]:
    """Run on a direct loop; returns what its handler of exceptions was told."""
    reported: list[dict[str, Any]] = []

    async def guarded() -> None:
        loop = asyncio.get_running_loop()
        assert isinstance(loop, DirectLoop)
        loop.set_exception_handler(lambda _, context: reported.append(context))
        async with asyncio.timeout(20.0):
            await work(loop)

    with asyncio.Runner(loop_factory=DirectLoop) as runner:
        runner.run(guarded())
    return reported


class Reader(asyncio.Protocol):
    """Notes what comes."""

    def __init__(self) -> None:
        self.got: list[bytes] = []
        self.lost: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self.more = asyncio.Event()

    def data_received(self, data: bytes) -> None:
        self.got.append(data)
        self.more.set()

    def connection_lost(self, exc: Exception | None) -> None:
        self.lost.set_result(None)


async def connected(
    loop: DirectLoop, take: Callable[[Reader], Callable[[bytes], None]]
) -> tuple[Reader, asyncio.Transport, socket.socket]:
    """A protocol that is read directly, its transport and the other end."""
    ours, theirs = socket.socketpair()
    transport, reader = await loop.create_connection(Reader, sock=ours)
    assert loop.read_directly(transport, take(reader))
    theirs.setblocking(False)
    return reader, transport, theirs


@pytest.mark.parametrize("behind", [b"", b"last words"])
def test_the_end_of_the_stream_is_the_transports(behind: bytes) -> None:
    async def work(loop: DirectLoop) -> None:
        reader, _, peer = await connected(loop, lambda r: r.data_received)
        if behind:
            peer.send(behind)
        peer.close()
        await reader.lost
        assert b"".join(reader.got) == behind

    assert play(work) == []


def test_what_a_protocol_raises_ends_its_transport_and_no_more() -> None:
    def fail(_: bytes) -> None:
        raise ValueError("of the protocol")

    async def work(loop: DirectLoop) -> None:
        reader, _, peer = await connected(loop, lambda _: fail)
        peer.send(b"x")
        await reader.lost
        await asyncio.sleep(0.0)
        peer.close()

    (context,) = play(work)
    assert isinstance(context["exception"], ValueError)


def test_who_reads_no_more_is_left_in_peace_and_hears_the_rest_later() -> None:
    async def work(loop: DirectLoop) -> None:
        reader, transport, peer = await connected(loop, lambda r: r.data_received)
        transport.pause_reading()
        peer.send(b"waits")
        await asyncio.sleep(0.01)
        assert reader.got == []
        transport.resume_reading()
        await reader.more.wait()
        assert reader.got == [b"waits"]
        transport.close()
        peer.close()

    assert play(work) == []


def test_a_number_that_is_used_again_is_not_read_for_the_one_before() -> None:
    async def work(loop: DirectLoop) -> None:
        first: list[bytes] = []
        old, transport, peer = await connected(loop, lambda _: first.append)
        number = transport.get_extra_info("socket").fileno()
        transport.abort()
        await old.lost
        peer.close()
        # The lowest free number is taken: that of the socket just closed.
        ours, theirs = socket.socketpair()
        again = ours if ours.fileno() == number else theirs
        assert again.fileno() == number
        other = theirs if again is ours else ours
        again_transport, reader = await loop.create_connection(Reader, sock=again)
        other.send(b"new")
        await reader.more.wait()
        assert (first, reader.got) == ([], [b"new"])
        again_transport.close()
        other.close()

    assert play(work) == []


# Timer


def test_the_timer_goes_off_once_not_before_its_time_beside_asyncios_own() -> None:
    async def work(loop: DirectLoop) -> None:
        start, went, theirs = loop.time(), list[float](), list[float]()

        def again() -> None:
            went.append(loop.time() - start)
            if len(went) < 5:
                loop.set_direct_timer(start + 0.01 * (len(went) + 1), again)

        loop.set_direct_timer(start + 0.01, again)
        for _ in range(4):
            await asyncio.sleep(0.015)
            theirs.append(loop.time() - start)
        assert len(went) == 5
        assert all(at >= 0.01 * (k + 1) for k, at in enumerate(went))
        assert all(at >= 0.015 * (k + 1) - 1e-3 for k, at in enumerate(theirs))

    assert play(work) == []


def test_a_peer_that_floods_holds_up_neither_tasks_nor_the_timer() -> None:
    async def work(loop: DirectLoop) -> None:
        full: list[int] = []

        def take(data: bytes) -> None:
            full.append(len(data))
            peer.send(bytes(1 << 14))  # there is always more

        _, transport, peer = await connected(loop, lambda _: take)
        went = loop.create_future()
        loop.set_direct_timer(loop.time() + 0.005, lambda: went.set_result(None))
        peer.send(b"x")
        await went
        await asyncio.sleep(0.005)
        assert len(full) > 1
        transport.abort()
        peer.close()

    play(work)
