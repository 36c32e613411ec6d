"""Hands connections from the process that accepts them to another process that serves them.

A connection travels over a pair of unix sockets (SCM_RIGHTS) with a number and its source. At the
other end `HandedAcceptor` accepts the connection like a listening socket; when the connection is
closed, its number is sent back. A connection that does not fit into the kernel's buffer is not
handed over, so that no process ever waits.
"""

from __future__ import annotations

import asyncio
import contextlib
import socket
import struct
from collections.abc import Callable
from typing import Any

from cohaptic_server.shell.limiter import ConnectionLimiter, Taken
from cohaptic_server.shell.refusal import turn_away

_WORDS = struct.Struct("<Q64s")  # number and source; the longest source is a network of IPv6
# Bytes that may wait; a connection counts as about 1 KiB. If more than a hundred connections wait
# before a room accepts any, the room hangs.
_WAITING = 64 * 1024
_TAKEN_AT_ONCE = 8  # connections accepted before other events of the loop have their turn
CAN_HAND_OVER = hasattr(socket, "send_fds") and hasattr(socket, "AF_UNIX")


def handing_pair() -> tuple[socket.socket, socket.socket]:
    """Return a socket pair: the end that hands connections over, and the end that receives them."""
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_STREAM)
    ours.setblocking(False)
    ours.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _WAITING)
    return ours, theirs


def hand_over(end: socket.socket, connection: socket.socket, number: int, source: str) -> bool:
    """Hand a connection over; the caller has to close its own socket in any case.

    Args:
        end: Sending end of a pair of `handing_pair`.
        connection: Socket of the connection.
        number: Number that is sent back when the connection ends.
        source: Network address against whose rate limits the connection counts.

    Returns:
        Whether the connection was handed over; False if too many wait, or the other end is closed.
    """
    try:
        socket.send_fds(end, [_WORDS.pack(number, source.encode())], [connection.fileno()])
    except OSError:  # also BlockingIOError, and ETOOMANYREFS: too many files are in flight
        return False
    return True


class HandedSocket(Taken):
    """A connection that was handed over to this process, and that reports when it is closed.

    Args:
        file: File descriptor of the connection.
        number: Number with which the connection was handed over.
        left: Called once with the number, when the connection is closed.
    """

    def __init__(self, file: int, number: int, left: Callable[[int], None]) -> None:
        super().__init__(fileno=file)
        self._number, self._left = number, left
        self._report = False

    def close(self) -> None:
        """Close the connection, and report its number."""
        super().close()
        if not self._report:
            self._report = True
            self._left(self._number)


class HandedAcceptor(socket.socket):
    """Accepts handed-over connections like a listening socket.

    Args:
        end: Receiving end of a pair; the acceptor takes over its file descriptor.
        limiter: Limiter that admits connections by their rate limits.
        left: Called with the number of each connection that has ended.
    """

    def __init__(
        self, end: socket.socket, limiter: ConnectionLimiter, left: Callable[[int], None]
    ) -> None:
        super().__init__(end.family, end.type, end.proto, fileno=end.detach())
        self.setblocking(False)
        self._limiter, self._left = limiter, left
        self._taken = 0

    def listen(self, backlog: int = 0, /) -> None:
        """Do nothing, since the socket pair is connected from the beginning."""

    def accept(self) -> tuple[socket.socket, Any]:
        """Return the next connection and its address; raises BlockingIOError if none waits now."""
        loop = asyncio.get_running_loop()
        while True:
            if self._taken >= _TAKEN_AT_ONCE:
                raise BlockingIOError
            data, files, _, _ = socket.recv_fds(self, _WORDS.size, 1)
            if not data:
                loop.remove_reader(self)  # the other end is closed: no connection comes any more
                raise BlockingIOError
            if self._taken == 0:
                loop.call_soon(self._go_on)
            self._taken += 1
            number, said = _WORDS.unpack(data)
            if not files:  # this process has no more file descriptors
                self._left(number)
                continue
            connection = HandedSocket(files[0], number, self._left)
            try:
                peer = connection.getpeername()
            except OSError:  # gone already
                connection.close()
                continue
            refusal = self._limiter.enter(connection, said.rstrip(b"\0").decode())
            if refusal is None:
                return connection, peer
            turn_away(connection, refusal)

    def close(self) -> None:
        """Accept no more connections, and close those that wait."""
        with contextlib.suppress(OSError, struct.error):
            while True:
                data, files, _, _ = socket.recv_fds(self, _WORDS.size, 1)
                if not data:
                    break
                for file in files:
                    socket.socket(fileno=file).close()
                self._left(_WORDS.unpack(data)[0])
        super().close()

    def _go_on(self) -> None:
        self._taken = 0
