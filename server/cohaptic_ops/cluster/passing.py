"""Passes the bytes of a connection on to the node that owns its room, and back."""

from __future__ import annotations

import asyncio
import socket
from typing import cast

from cohaptic_ops.cluster.lines import ACCEPTED, Pass, encode

# Bytes that wait in this process for a peer that reads slowly; then the other side has to wait. A
# room leaves out patches for such a peer, so that what waits here must not be much.
_WAITING = 16 * 1024
_WITHIN = 1.0  # s for another node to take a connection
_LAST_BYTES = 5.0  # s for one side to take what the other has written before it ended
# Time after which a connection to a node that has vanished ends [ms]. The kernel counts the time of
# a visitor who does not read, too; people notice the loss before, and come again by themselves.
_VANISHED = 20_000


class _Half(asyncio.Protocol):
    """One of the two connections that make up a passed one."""

    def __init__(self) -> None:
        self.other: _Half | None = None
        self.ended: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self.answered: asyncio.Future[bytes] = asyncio.get_running_loop().create_future()
        self.transport: asyncio.Transport | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Store the transport; the event loop calls this at the beginning."""
        self.transport = cast("asyncio.Transport", transport)
        self.transport.set_write_buffer_limits(_WAITING)

    def data_received(self, data: bytes) -> None:
        """Pass bytes on; the first ones of the other node answer `Pass`, and the rest waits."""
        if self.other is not None and self.other.transport is not None:
            self.other.transport.write(data)
        elif self.transport is not None and not self.answered.done():
            self.transport.pause_reading()
            self.answered.set_result(data)

    def pause_writing(self) -> None:
        """Read no more from the other side, since this one reads slowly."""
        if self.other is not None and self.other.transport is not None:
            self.other.transport.pause_reading()

    def resume_writing(self) -> None:
        """Read from the other side again."""
        if self.other is not None and self.other.transport is not None:
            self.other.transport.resume_reading()

    def connection_lost(self, exc: Exception | None) -> None:
        """End the other side too, after it has got all bytes."""
        if not self.ended.done():
            self.ended.set_result(None)
        if not self.answered.done():
            self.answered.set_result(b"")
        if self.other is not None and self.other.transport is not None:
            self.other.transport.close()


async def pass_on(connection: socket.socket, address: str, words: Pass) -> bool:
    """Pass a connection on until it ends; return False at once if the other node does not take it.

    Args:
        connection: Socket of the connection, which is closed at its end; not if it is not taken.
        address: Address of the other node, HOST:PORT.
        words: Room and source of the connection.
    """
    loop = asyncio.get_running_loop()
    host, _, port = address.rpartition(":")
    near, far = _Half(), _Half()
    try:
        async with asyncio.timeout(_WITHIN):
            await loop.create_connection(lambda: far, host.strip("[]"), int(port))
            assert far.transport is not None
            notice_end(far.transport.get_extra_info("socket"))
            far.transport.write(encode(words))
            answer = await far.answered
        if answer[:1] != ACCEPTED:
            return False
        near.other, far.other = far, near
        await loop.connect_accepted_socket(lambda: near, connection)
        assert near.transport is not None
        near.transport.write(answer[1:])
        far.transport.resume_reading()
        await asyncio.wait({near.ended, far.ended}, return_when=asyncio.FIRST_COMPLETED)
        await asyncio.wait({near.ended, far.ended}, timeout=_LAST_BYTES)
    except OSError:  # also TimeoutError
        return near.transport is not None
    finally:
        for half in (near, far):
            if half.transport is not None:
                half.transport.abort()
    return True


def notice_end(connection: socket.socket) -> None:
    """Let the kernel end a connection whose other end is silent, also if nothing is written."""
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    limits = {
        "TCP_KEEPIDLE": 1,
        "TCP_KEEPINTVL": 1,
        "TCP_KEEPCNT": 2,
        "TCP_USER_TIMEOUT": _VANISHED,
    }
    for name, value in limits.items():
        if hasattr(socket, name):  # not every system has each
            connection.setsockopt(socket.IPPROTO_TCP, getattr(socket, name), value)
