"""Connections from hand to hand, within one process."""

from __future__ import annotations

import asyncio
import socket
import sys
from collections.abc import Generator

import pytest

from cohaptic.clock import SystemClock
from cohaptic_ops.rooms.process.handing_over import HandedAcceptor, hand_over, handing_pair
from cohaptic_server.guard.limits import Limits
from cohaptic_server.shell.limiter import ConnectionLimiter
from tests.patience import PATIENCE

pytestmark = [
    pytest.mark.live,
    pytest.mark.skipif(sys.platform == "win32", reason="hands sockets over"),
]


@pytest.fixture
def connected() -> Generator[tuple[socket.socket, socket.socket]]:
    """Both ends of a connection over loopback."""
    with socket.create_server(("127.0.0.1", 0)) as listening:
        ours = socket.create_connection(listening.getsockname(), timeout=PATIENCE)
        theirs, _ = listening.accept()
    with ours, theirs:
        yield ours, theirs


def limiter(*limits: str) -> ConnectionLimiter:
    return ConnectionLimiter(Limits().changed(limits), SystemClock())


def test_a_connection_comes_out_as_from_a_listening_socket_and_its_number_back(
    connected: tuple[socket.socket, socket.socket],
) -> None:
    ours, theirs = connected

    async def main() -> None:
        left: list[int] = []
        end, inner = handing_pair()
        counting = limiter()
        with end, HandedAcceptor(inner, counting, left.append) as acceptor:
            ours.sendall(b"before it was handed over")
            assert hand_over(end, theirs, 7, "198.51.100.7")
            theirs.close()
            connection, peer = acceptor.accept()
            assert peer == ours.getsockname()
            # It counts against the source that was told, not against the peer.
            (counted,) = counting.taken.values()
            assert counted.source == "198.51.100.7"
            with pytest.raises(BlockingIOError):
                acceptor.accept()
            connection.setblocking(True)
            assert connection.recv(100) == b"before it was handed over"
            assert left == []
            connection.close()
            connection.close()
            assert left == [7]
            assert ours.recv(1) == b""

    asyncio.run(main())


def test_whom_a_room_has_no_budget_for_is_told_and_counted_out(
    connected: tuple[socket.socket, socket.socket],
) -> None:
    ours, theirs = connected

    async def main() -> None:
        left: list[int] = []
        end, inner = handing_pair()
        with end, HandedAcceptor(inner, limiter("open=1"), left.append) as acceptor:
            assert hand_over(end, theirs, 1, "127.0.0.1")
            first, _ = acceptor.accept()
            assert hand_over(end, theirs, 2, "127.0.0.1")
            with pytest.raises(BlockingIOError):
                acceptor.accept()
            assert left == [2]
            assert ours.recv(100).startswith(b"HTTP/1.1 429 ")
            first.close()

    asyncio.run(main())


def test_a_room_that_takes_nobody_costs_no_wait_and_a_bounded_number_of_files(
    connected: tuple[socket.socket, socket.socket],
) -> None:
    _, theirs = connected

    async def main() -> None:
        left: list[int] = []
        end, inner = handing_pair()
        acceptor = HandedAcceptor(inner, limiter(), left.append)
        with end:
            taken = 0
            while hand_over(end, theirs, taken, "127.0.0.1"):
                taken += 1
                assert taken < 1000
            assert taken > 20
            acceptor.close()  # they are counted out with it
            assert left == list(range(taken))
            assert not hand_over(end, theirs, 0, "127.0.0.1")

    asyncio.run(main())


def test_when_the_front_is_gone_nobody_comes_and_nothing_spins() -> None:
    async def main() -> None:
        end, inner = handing_pair()
        with HandedAcceptor(inner, limiter(), lambda _: None) as acceptor:
            calls: list[int] = []
            loop = asyncio.get_running_loop()

            def look() -> None:
                calls.append(1)
                with pytest.raises(BlockingIOError):
                    acceptor.accept()

            loop.add_reader(acceptor, look)
            end.close()
            await asyncio.sleep(0.05)
            assert calls == [1]

    asyncio.run(main())
