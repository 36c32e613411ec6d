"""Connections that have not sent a request yet, kept as plain sockets in one epoll set.

asyncio makes a transport, a protocol, a task and timers for each connection, which take 0.3 ms and
14 kB. A connection that is still silent needs none of them. Epoll reports the connections that have
sent bytes, and takes no time for the others. The porch peeks at the bytes and leaves them to the
handler that serves the connection. Since the bytes stay in the socket, epoll is edge-triggered: it
reports only new bytes.

A connection is passed on to asyncio after it has sent the head of a request, or a TLS hello.
Connections that send anything else are passed on too: the code that reads the bytes judges them.
"""

from __future__ import annotations

import select
import socket
import sys
from collections import OrderedDict
from dataclasses import dataclass

from cohaptic.protocol.websocket_frames import END_OF_HEAD

MOST = 4096  # bytes that are looked at; a longer head, or TLS hello, is passed on before its end
_HANDSHAKE = b"\x16"  # type of a TLS record; two bytes of version and two of length follow
_RECORD_HEAD = 5


def has_asked(seen: bytes, *, tls: bool) -> bool:
    """Whether a connection has sent its request, or anything that need not be waited for.

    Args:
        seen: All bytes so far, or the first `MOST` of them; not empty.
        tls: Whether the connection has to begin with a TLS handshake.
    """
    if len(seen) >= MOST:
        return True
    if not tls:
        return END_OF_HEAD in seen or not seen[:1].isalpha()
    if seen[:1] != _HANDSHAKE:
        return True
    length = _RECORD_HEAD + int.from_bytes(seen[3:_RECORD_HEAD])
    return len(seen) >= max(length, _RECORD_HEAD)


CAN_HOLD = sys.platform == "linux"
# Number of times that the porch looks at a connection. A head comes in one piece or two; a client
# that sends it byte by byte is passed on, and spends the budgets of a served connection.
_MOST_LOOKS = 64


@dataclass(eq=False, slots=True)
class Silent:
    """One silent connection: the client has not sent its whole request yet.

    Args:
        source: Address or group of addresses whose budgets the connection spends.
        deadline: Time by which the client has to send its request [s].
        looks: Number of times that the porch has looked at new bytes.
    """

    connection: socket.socket
    source: str
    deadline: float
    looks: int = 0


class Porch:
    """The silent connections of one door, on a system with epoll.

    Args:
        door: File descriptor of the listening socket, which is watched too.
        tls: Whether connections begin with a TLS handshake.
    """

    def __init__(self, door: int, *, tls: bool) -> None:
        assert sys.platform == "linux"
        self._door, self._tls = door, tls
        # The first connection has the next deadline: all have the same time-out, and the clock is
        # monotonic.
        self._held: OrderedDict[int, Silent] = OrderedDict()
        self._events = select.EPOLLIN | select.EPOLLRDHUP | select.EPOLLET
        self._ends = select.EPOLLRDHUP | select.EPOLLHUP | select.EPOLLERR
        self._set, self._shown = select.epoll(), select.epoll()
        self._set.register(door, select.EPOLLIN)
        self._shown.register(self._set.fileno(), select.EPOLLIN)

    def __len__(self) -> int:
        return len(self._held)

    def fileno(self) -> int:
        """File descriptor that is readable when `ready` would return a file, unless hidden."""
        return self._shown.fileno()

    def show(self, *, readable: bool) -> None:
        """Let the event loop see ready files, or hide them so that they do not wake the loop."""
        self._shown.modify(self._set.fileno(), select.EPOLLIN if readable else 0)

    def hold(self, connection: socket.socket, source: str, deadline: float) -> None:
        """Watch a connection until it has sent its request.

        Args:
            connection: Non-blocking socket.
            source: Address or group of addresses whose budgets the connection spends.
            deadline: Time by which the request has to come [s]; not earlier than the deadline of
                any connection that is held already.

        Raises:
            OSError: The system has no memory for another watched connection.
        """
        file = connection.fileno()
        self._set.register(file, self._events)
        self._held[file] = Silent(connection, source, deadline)

    def ready(self) -> tuple[int, bool] | None:
        """Find a socket with news: the door, or a connection that has sent bytes or has ended.

        Returns:
            File descriptor, and whether the client will send nothing more; None if there is none.
        """
        found = self._set.poll(0, 1)
        return (found[0][0], bool(found[0][1] & self._ends)) if found else None

    def look(self, file: int, *, ends: bool) -> tuple[Silent | None, bool]:
        """Look at the bytes of a connection, and release it if it is to be served or has ended.

        Args:
            file: File descriptor from `ready`.
            ends: Whether the client will send nothing more, as `ready` has returned it.

        Returns:
            The released connection, and whether it is to be served; None for the connection while
            it is still held.
        """
        one = self._held.get(file)
        if one is None:
            return None, False
        one.looks += 1
        try:
            seen = one.connection.recv(MOST, socket.MSG_PEEK)
        except BlockingIOError:
            return None, False
        except OSError:
            seen = b""
        asked = bool(seen) and has_asked(seen, tls=self._tls)
        if seen and not ends and not asked and one.looks < _MOST_LOOKS:
            return None, False
        self._forget(file)
        return one, asked or (bool(seen) and not ends)

    def next_deadline(self) -> float | None:
        """The earliest deadline [s]; None if no connection is held."""
        return next(iter(self._held.values())).deadline if self._held else None

    def overdue(self, now: float, most: int) -> list[Silent]:
        """Release and return at most `most` connections whose deadline is past."""
        found: list[Silent] = []
        for one in self._held.values():
            if one.deadline > now or len(found) == most:
                break
            found.append(one)
        for one in found:
            self._forget(one.connection.fileno())
        return found

    def close(self) -> list[Silent]:
        """Stop watching; returns the connections that were held."""
        held = list(self._held.values())
        self._held.clear()
        self._shown.close()
        self._set.close()
        return held

    def _forget(self, file: int) -> None:
        del self._held[file]
        self._set.unregister(file)
