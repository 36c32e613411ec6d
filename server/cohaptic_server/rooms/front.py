"""Accepts every connection and gives it to its room, by the path that its request asks for.

It looks at the first bytes without taking them (MSG_PEEK): the room reads the whole request.
A peer that sends none within a few seconds is closed; nothing here waits for a peer or a room.
"""

from __future__ import annotations

import asyncio
import itertools
import logging
import socket
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

from cohaptic_server.guard.sources import Refusal
from cohaptic_server.rooms.request_line import MOST, target_of
from cohaptic_server.shell.door import Door, turn_away
from cohaptic_server.shell.gate import Gate, Taken, source_of_peer
from cohaptic_server.shell.wire import HEAD_TIMEOUT

log = logging.getLogger("cohaptic.server")

# s until a request whose first line is not complete is looked at again; twice as long each time.
# Bytes that were only looked at make a socket readable without an end, so it is not waited for.
_AGAIN = 2e-3
_BUSY = Refusal("the room does not take anybody at present", 2.0)


class Place(Protocol):
    """Whom a connection may be handed to."""

    def take(self, connection: socket.socket, number: int, source: str) -> bool:
        """Hand it over; returns whether it is taken. The source is to be counted out later."""
        ...


@dataclass(eq=False, slots=True)
class _Newcomer:
    """A connection whose request has not been seen.

    Args:
        connection: Its socket.
        source: Whom it is counted with.
        deadline: Ends it.
        again: When it is looked at again; None while it is waited for.
        pause: Until then [s].
    """

    connection: socket.socket
    source: str
    deadline: asyncio.TimerHandle | None = None
    again: asyncio.TimerHandle | None = None
    pause: float = _AGAIN


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
        self._newcomers: set[_Newcomer] = set()
        self._numbers = itertools.count(1)
        self._loop = asyncio.get_running_loop()

    @property
    def newcomers(self) -> int:
        """Connections whose request has not been seen."""
        return len(self._newcomers)

    def open(self) -> None:
        """Let people in."""
        for door in self._doors:
            self._loop.add_reader(door, self._accept, door)

    def close(self) -> None:
        """Let nobody in any more, and close who has not said where to."""
        for door in self._doors:
            self._loop.remove_reader(door)
            door.close()
        for newcomer in list(self._newcomers):
            self._drop(newcomer)

    def left(self, source: str) -> None:
        """A connection of an address has ended."""
        self._gate.sources.leave(source)

    def _accept(self, door: Door) -> None:
        try:
            connection, peer = door.accept()
        except OSError:  # nobody any more, for now
            return
        connection.setblocking(False)
        if isinstance(connection, Taken):
            connection.keep_counted()
        newcomer = _Newcomer(connection, source_of_peer(peer))
        newcomer.deadline = self._loop.call_later(HEAD_TIMEOUT, self._expire, newcomer)
        self._newcomers.add(newcomer)
        self._look(newcomer)

    def _look(self, newcomer: _Newcomer) -> None:
        """Look for the request, and wait for it where it has not come."""
        newcomer.again = None
        try:
            seen = newcomer.connection.recv(MOST, socket.MSG_PEEK)
        except BlockingIOError:
            self._loop.add_reader(newcomer.connection, self._look, newcomer)
            return
        except OSError:
            self._drop(newcomer)
            return
        self._loop.remove_reader(newcomer.connection)
        target = target_of(seen)
        if not seen:
            self._drop(newcomer)
        elif target is None:
            newcomer.again = self._loop.call_later(newcomer.pause, self._look, newcomer)
            newcomer.pause *= 2.0
        else:
            self._place(newcomer, target)

    def _place(self, newcomer: _Newcomer, target: str) -> None:
        self._forget(newcomer)
        number = next(self._numbers)
        for place in self._places(target):
            if place.take(newcomer.connection, number, newcomer.source):
                newcomer.connection.close()  # our end of it; the room has its own
                return
        self.left(newcomer.source)
        turn_away(newcomer.connection, _BUSY, 503)

    def _expire(self, newcomer: _Newcomer) -> None:
        source = newcomer.source
        told = f"{source} sent no request in {HEAD_TIMEOUT:g} s"
        self._gate.tell(source, "no_request", told)
        self._drop(newcomer)

    def _drop(self, newcomer: _Newcomer) -> None:
        """Close a connection that asks for nothing."""
        self._forget(newcomer)
        self._loop.remove_reader(newcomer.connection)
        newcomer.connection.close()
        self.left(newcomer.source)

    def _forget(self, newcomer: _Newcomer) -> None:
        self._newcomers.discard(newcomer)
        for timer in (newcomer.deadline, newcomer.again):
            if timer is not None:
                timer.cancel()
