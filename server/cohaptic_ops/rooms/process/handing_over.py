"""Connections from hand to hand: one process accepts them, and another one serves them.

A connection travels over a pair of unix sockets (SCM_RIGHTS) with a number. At the other end it
comes out of what asyncio takes for a listening socket, and when it is closed its number comes back.
What does not fit into the kernel's buffer is not taken: nobody waits.
"""

from __future__ import annotations

import asyncio
import contextlib
import socket
import struct
from collections.abc import Callable
from typing import Any

from cohaptic_server.shell.doors.turn_away import turn_away
from cohaptic_server.shell.gate import Gate, Taken

_NUMBER = struct.Struct("<Q")
# Bytes that may wait; a connection counts as 1 KiB or so. More than a hundred newcomers before a
# room looks for them once means that it hangs.
_WAITING = 64 * 1024
_TAKEN_AT_ONCE = 8  # before other events have their turn, as at a door
CAN_HAND_OVER = hasattr(socket, "send_fds") and hasattr(socket, "AF_UNIX")


def handing_pair() -> tuple[socket.socket, socket.socket]:
    """The end that hands connections over, and the one that they come out of."""
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_STREAM)
    ours.setblocking(False)
    ours.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _WAITING)
    return ours, theirs


def hand_over(end: socket.socket, connection: socket.socket, number: int) -> bool:
    """Give a connection away; it stays ours, to be closed, in any case.

    Returns:
        Whether it was taken. It was not where too many wait, or the other end is gone.
    """
    try:
        socket.send_fds(end, [_NUMBER.pack(number)], [connection.fileno()])
    except OSError:  # also BlockingIOError, and ETOOMANYREFS: too many files are on their way
        return False
    return True


class HandedSocket(Taken):
    """A connection that was handed over; says so when it is closed.

    Args:
        file: Its descriptor.
        number: That it came with.
        left: Called with the number once.
    """

    def __init__(self, file: int, number: int, left: Callable[[int], None]) -> None:
        super().__init__(fileno=file)
        self._number, self._left = number, left
        self._told = False

    def close(self) -> None:
        """Close it."""
        super().close()
        if not self._told:
            self._told = True
            self._left(self._number)


class HandedDoor(socket.socket):
    """Connections come out of it as out of a listening socket.

    Args:
        end: End of a pair; its file is the door's from now on.
        gate: Knows whom there is a budget for.
        left: Called with the number of each connection that has ended.
    """

    def __init__(self, end: socket.socket, gate: Gate, left: Callable[[int], None]) -> None:
        super().__init__(end.family, end.type, end.proto, fileno=end.detach())
        self.setblocking(False)
        self._gate, self._left = gate, left
        self._taken = 0

    def listen(self, backlog: int = 0, /) -> None:
        """Nothing: it was connected from the beginning."""

    def accept(self) -> tuple[socket.socket, Any]:
        """The next connection; BlockingIOError if there is none for now."""
        loop = asyncio.get_running_loop()
        while True:
            if self._taken >= _TAKEN_AT_ONCE:
                raise BlockingIOError
            data, files, _, _ = socket.recv_fds(self, _NUMBER.size, 1)
            if not data:
                loop.remove_reader(self)  # the other end is gone: nobody comes any more
                raise BlockingIOError
            if self._taken == 0:
                loop.call_soon(self._go_on)
            self._taken += 1
            (number,) = _NUMBER.unpack(data)
            if not files:  # this process has no more of them
                self._left(number)
                continue
            connection = HandedSocket(files[0], number, self._left)
            try:
                peer = connection.getpeername()
            except OSError:  # gone already
                connection.close()
                continue
            refusal = self._gate.enter(connection, self._gate.source_of_peer(peer))
            if refusal is None:
                return connection, peer
            turn_away(connection, refusal)

    def close(self) -> None:
        """Take nobody any more; who waits is closed."""
        with contextlib.suppress(OSError, struct.error):
            while True:
                data, files, _, _ = socket.recv_fds(self, _NUMBER.size, 1)
                if not data:
                    break
                for file in files:
                    socket.socket(fileno=file).close()
                self._left(_NUMBER.unpack(data)[0])
        super().close()

    def _go_on(self) -> None:
        self._taken = 0
