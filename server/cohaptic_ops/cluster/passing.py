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
    try:
        async with asyncio.timeout(_WITHIN):
            _, far = await loop.create_connection(_Half, host.strip("[]"), int(port))
            assert far.transport is not None
            far.transport.write(encode(words))
            answer = await far.answered
    except OSError:  # also TimeoutError
        return False
    if answer[:1] != ACCEPTED:
        far.transport.abort()
        return False
    near = _Half()
    near.other, far.other = far, near
    await loop.connect_accepted_socket(lambda: near, connection)
    assert near.transport is not None
    assert far.transport is not None
    near.transport.write(answer[1:])
    far.transport.resume_reading()
    try:
        await asyncio.wait({near.ended, far.ended}, return_when=asyncio.FIRST_COMPLETED)
        await asyncio.wait({near.ended, far.ended})
    finally:
        near.transport.abort()
        far.transport.abort()
    return True
