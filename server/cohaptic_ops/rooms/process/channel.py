"""Exchanges lines between a room's process and its rooms server over a socket pair."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Callable

from cohaptic_ops.monitoring.json_lines import BadLine
from cohaptic_ops.rooms.process.reports import LONGEST, Line, decode, encode


class Channel(asyncio.Protocol):
    """One end of a channel; `open_channel` makes it.

    Args:
        take: Called with each line that comes.
        end: Called when the channel has ended: the other end was closed, or sent an invalid line.

    Attributes:
        open: Whether the other end is connected.
    """

    def __init__(self, take: Callable[[Line], None], end: Callable[[], None]) -> None:
        self.open = False
        self._take, self._end = take, end
        self._rest = b""
        self._transport: asyncio.WriteTransport | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Store the transport; the event loop calls this at the beginning."""
        assert isinstance(transport, asyncio.WriteTransport)
        self._transport, self.open = transport, True

    def data_received(self, data: bytes) -> None:
        """Cut bytes from the other end into lines; the event loop calls this."""
        *lines, self._rest = (self._rest + data).split(b"\n")
        try:
            if len(self._rest) > LONGEST:
                raise BadLine("a line without an end")
            for line in lines:
                self._take(decode(line))
        except BadLine:
            self.close()

    def connection_lost(self, exc: Exception | None) -> None:
        """Report the end of the channel; the event loop calls this."""
        self.open = False
        self._end()

    def tell(self, line: Line) -> None:
        """Write a line without waiting; do nothing if the channel has ended."""
        if self._transport is not None and self.open:
            self._transport.write(encode(line))

    def tell_newest(self, line: Line) -> bool:
        """Write a line unless earlier lines are still unread; return whether it was written."""
        if self._transport is None or not self.open or self._transport.get_write_buffer_size():
            return False
        self._transport.write(encode(line))
        return True

    def close(self) -> None:
        """Close the channel after the waiting lines are written."""
        if self._transport is not None:
            self._transport.close()

    def abort(self) -> None:
        """Close the channel at once, without writing the waiting lines."""
        if self._transport is not None:
            self._transport.abort()


async def open_channel(
    end: socket.socket, take: Callable[[Line], None], ended: Callable[[], None]
) -> Channel:
    """Return a channel over one end of a pair of stream sockets.

    Args:
        end: End of the socket pair.
        take: Called with each line that comes.
        ended: Called when the channel has ended: the other end was closed, or sent an invalid line.
    """
    loop = asyncio.get_running_loop()
    end.setblocking(False)
    _, channel = await loop.connect_accepted_socket(lambda: Channel(take, ended), end)
    return channel
