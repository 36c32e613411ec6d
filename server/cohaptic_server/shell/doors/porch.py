"""Connections that have not asked for anything yet: each a socket, in one set that is watched.

asyncio makes a transport, a protocol, a task and timers of a connection, for 0.3 ms and 14 kB. One
that is silent needs none of them. The set is the system's (epoll): it tells who has spoken, and
takes no time for those who have not. Bytes are looked at, not taken: whoever serves the connection
reads all of them. As they stay, it is their arrival that is told, and not their presence.

A connection is worth a transport once it has said the head of a request, or a hello. Bytes that are
neither are passed on too, and are judged where they are read.
"""

from __future__ import annotations

import select
import socket
import sys
from collections import OrderedDict
from dataclasses import dataclass

from cohaptic.protocol.websocket_frames import END_OF_HEAD

MOST = (
    4096  # bytes that are looked at; of a longer head, or hello of TLS, the rest is not waited for
)
_HANDSHAKE = b"\x16"  # of TLS: the type of a record, two bytes of version, two of its length follow
_RECORD_HEAD = 5


def has_asked(seen: bytes, *, tls: bool) -> bool:
    """Whether it has asked for something.

    Args:
        seen: All that has come so far, or the first `MOST` bytes of it; not empty.
        tls: Whether it has to begin with a handshake.
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
# Times that a connection is looked at. A head comes in one piece or two; who sends it byte by byte
# is passed on, and has the budgets of one who is served.
_MOST_LOOKS = 64


@dataclass(eq=False, slots=True)
class Silent:
    """One that is held.

    Args:
        connection: Its socket.
        source: Whom it is counted with.
        deadline: Until it has to ask [s].
        looks: How often it has said something.
    """

    connection: socket.socket
    source: str
    deadline: float
    looks: int = 0


class Porch:
    """Those of one door, for a system with epoll.

    Args:
        door: File of the listening socket, which is watched too.
        tls: Whether connections begin with a handshake.
    """

    def __init__(self, door: int, *, tls: bool) -> None:
        assert sys.platform == "linux"
        self._door, self._tls = door, tls
        # The first is the next that is due: all have the same time, and a clock does not go back.
        self._held: OrderedDict[int, Silent] = OrderedDict()
        self._events = select.EPOLLIN | select.EPOLLRDHUP | select.EPOLLET
        self._ends = select.EPOLLRDHUP | select.EPOLLHUP | select.EPOLLERR
        self._set, self._shown = select.epoll(), select.epoll()
        self._set.register(door, select.EPOLLIN)
        self._shown.register(self._set.fileno(), select.EPOLLIN)

    def __len__(self) -> int:
        return len(self._held)

    def fileno(self) -> int:
        """Descriptor that is readable when `ready` would tell of one, and it is shown."""
        return self._shown.fileno()

    def show(self, *, readable: bool) -> None:
        """Whether it is to be seen that somebody is ready; an event loop would ask at once."""
        self._shown.modify(self._set.fileno(), select.EPOLLIN if readable else 0)

    def hold(self, connection: socket.socket, source: str, deadline: float) -> None:
        """Watch a connection.

        Args:
            connection: That does not block.
            source: Whom it is counted with.
            deadline: Until it has to ask, which is not before that of any other [s].

        Raises:
            OSError: The system has no memory for it.
        """
        file = connection.fileno()
        self._set.register(file, self._events)
        self._held[file] = Silent(connection, source, deadline)

    def ready(self) -> tuple[int, bool] | None:
        """The file of the door, or of one who has said something or will say no more.

        Returns:
            The file, and whether nothing comes any more; None if there is nobody.
        """
        found = self._set.poll(0, 1)
        return (found[0][0], bool(found[0][1] & self._ends)) if found else None

    def look(self, file: int, *, ends: bool) -> tuple[Silent | None, bool]:
        """Whether one who has said something has asked; that one is held no longer.

        Args:
            file: As `ready` has told it.
            ends: The same.

        Returns:
            Who has asked or gone, and whether it has asked; None while it may go on.
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
        """When the next is due [s]; None if nobody is held."""
        return next(iter(self._held.values())).deadline if self._held else None

    def overdue(self, now: float, most: int) -> list[Silent]:
        """So many at the most whose time is over; they are held no longer."""
        found: list[Silent] = []
        for one in self._held.values():
            if one.deadline > now or len(found) == most:
                break
            found.append(one)
        for one in found:
            self._forget(one.connection.fileno())
        return found

    def close(self) -> list[Silent]:
        """Watch nobody any more; returns who was held."""
        held = list(self._held.values())
        self._held.clear()
        self._shown.close()
        self._set.close()
        return held

    def _forget(self, file: int) -> None:
        del self._held[file]
        self._set.unregister(file)
