"""Gives every connection that has asked for something to its room, by the path that it asks for.

It looks at the first bytes without taking them (MSG_PEEK): the room reads the whole request. Who
has not asked yet is the door's to hold; nothing here waits for a peer or a room.
"""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import socket
from collections.abc import Callable, Sequence
from typing import Protocol

from cohaptic_server.guard.sources import Refusal
from cohaptic_server.rooms.request_line import MOST, target_of
from cohaptic_server.shell.doors.door import Door
from cohaptic_server.shell.doors.turn_away import turn_away
from cohaptic_server.shell.gate import Gate, Taken
from cohaptic_server.shell.wire import HEAD_TIMEOUT

# s until a request whose first line is not complete is looked at again; twice as long each time,
# and given up beyond `HEAD_TIMEOUT`. So it may be where doors hold nobody, and of who sends its
# bytes one by one.
_AGAIN = 2e-3
_BUSY = Refusal("the room does not take anybody at present", 2.0)


class Place(Protocol):
    """Whom a connection may be handed to."""

    def take(self, connection: socket.socket, number: int, source: str) -> bool:
        """Hand it over; returns whether it is taken. The source is to be counted out later."""
        ...


class Front:
    """The doors of a server with many rooms.

    Args:
        doors: Listening sockets.
        gate: Whom there is a budget for.
        places: Where a request for a target may go, the best first.
    """

    def __init__(
        self, doors: Sequence[Door], gate: Gate, places: Callable[[str], Sequence[Place]]
    ) -> None:
        self._doors, self._gate, self._places = doors, gate, places
        self._numbers = itertools.count(1)
        self._loop = asyncio.get_running_loop()

    def open(self) -> None:
        """Let people in."""
        for door in self._doors:
            self._loop.add_reader(door, self._accept, door)

    def close(self) -> None:
        """Let nobody in any more, and close who has not said where to."""
        for door in self._doors:
            self._loop.remove_reader(door)
            door.close()

    def left(self, source: str) -> None:
        """A connection of an address has ended."""
        self._gate.sources.leave(source)

    def _accept(self, door: Door) -> None:
        with contextlib.suppress(OSError):  # nobody any more, for now
            while True:
                connection, peer = door.accept()
                connection.setblocking(False)
                if isinstance(connection, Taken):
                    connection.keep_counted()
                self._look(connection, self._gate.source_of_peer(peer))

    def _look(self, connection: socket.socket, source: str, pause: float = _AGAIN) -> None:
        """Look for the request, and later again where its line is not complete."""
        seen: bytes | None
        try:
            seen = connection.recv(MOST, socket.MSG_PEEK)
        except BlockingIOError:
            seen = None
        except OSError:
            seen = b""
        target = None if seen is None else target_of(seen)
        if seen == b"" or (target is None and pause > HEAD_TIMEOUT):
            connection.close()
            self.left(source)
        elif target is None:
            self._loop.call_later(pause, self._look, connection, source, 2.0 * pause)
        else:
            self._place(connection, source, target)

    def _place(self, connection: socket.socket, source: str, target: str) -> None:
        number = next(self._numbers)
        for place in self._places(target):
            if place.take(connection, number, source):
                connection.close()  # our end of it; the room has its own
                return
        self.left(source)
        turn_away(connection, _BUSY, 503)
