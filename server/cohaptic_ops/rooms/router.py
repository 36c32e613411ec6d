"""Hands each connection to the room that the path of its request names.

The router peeks at the first bytes of a request (MSG_PEEK) and leaves them to the room, which reads
the whole request. Connections without a request wait at the acceptor. This module never waits for a
peer or a room.

If no room takes a connection, the server itself answers, with the list of rooms or with the reason
why the room cannot be entered.
"""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import re
import socket
from collections.abc import Awaitable, Callable, Sequence
from typing import Protocol

from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request as HttpRequest
from websockets.http11 import Response

from cohaptic_ops.rooms.listing import RoomState, answer, turned_away
from cohaptic_ops.rooms.process.handing_over import HandedAcceptor, hand_over, handing_pair
from cohaptic_server.guard.sources import Refusal
from cohaptic_server.settings import ServerSettings
from cohaptic_server.shell.acceptor import Acceptor
from cohaptic_server.shell.http import DOWNLOAD_TIMEOUT, HostCheck, plain, response, too_many
from cohaptic_server.shell.limiter import ConnectionLimiter, Taken
from cohaptic_server.shell.listener import Listener, serve_acceptors
from cohaptic_server.shell.refusal import refuse, turn_away
from cohaptic_server.shell.wire import HEAD_TIMEOUT, Wire

# Time until the router looks again at a request with an incomplete first line [s]. The pause
# doubles each time, and the router gives up beyond `HEAD_TIMEOUT`. Incomplete lines come on systems
# where acceptors hold no connections, and from clients that send their bytes one by one.
_AGAIN = 2e-3
BUSY = Refusal("the room does not take anybody at present", 2.0)


class Place(Protocol):
    """A receiver of connections: a room, or the server's own `Site`."""

    def take(self, connection: socket.socket, source: str) -> bool:
        """Take over a connection; return whether that worked.

        A place that has taken a connection must report the connection's source when the connection
        ends.

        Args:
            connection: Socket of the connection.
            source: Network address against whose rate limits the connection counts.
        """
        ...


class Router:
    """Accepts the connections of a server with many rooms, and hands them to rooms.

    Args:
        acceptors: Listening sockets.
        limiter: Limiter that counts the connections.
        places: Returns the places that may take a request with this target, the best first.
    """

    def __init__(
        self,
        acceptors: Sequence[Acceptor],
        limiter: ConnectionLimiter,
        places: Callable[[str], Sequence[Place]],
    ) -> None:
        self._acceptors, self._limiter, self._places = acceptors, limiter, places
        self._loop = asyncio.get_running_loop()

    def open(self) -> None:
        """Start to accept connections."""
        for acceptor in self._acceptors:
            self._loop.add_reader(acceptor, self._accept, acceptor)

    def close(self) -> None:
        """Accept no more connections, and close those without a request."""
        for acceptor in self._acceptors:
            self._loop.remove_reader(acceptor)
            acceptor.close()

    def _accept(self, acceptor: Acceptor) -> None:
        with contextlib.suppress(OSError):  # no further connection waits for now
            while True:
                connection, peer = acceptor.accept()
                connection.setblocking(False)
                if isinstance(connection, Taken):
                    connection.keep_counted()
                self._look(connection, self._limiter.source_of_peer(peer))

    def _look(self, connection: socket.socket, source: str, pause: float = _AGAIN) -> None:
        """Hand a connection over, or look again later if the request's first line is incomplete."""
        seen: bytes | None
        try:
            seen = connection.recv(LARGEST, socket.MSG_PEEK)
        except BlockingIOError:
            seen = None
        except OSError:
            seen = b""
        target = None if seen is None else target_of(seen)
        if seen == b"" or (target is None and pause > HEAD_TIMEOUT):
            connection.close()
            self._limiter.sources.leave(source)
        elif target is None:
            self._loop.call_later(pause, self._look, connection, source, 2.0 * pause)
        else:
            self._place(connection, source, target)

    def _place(self, connection: socket.socket, source: str, target: str) -> None:
        for place in self._places(target):
            if place.take(connection, source):
                connection.close()  # our socket only; the room has its own
                return
        self._limiter.sources.leave(source)
        turn_away(connection, BUSY, 503)


LARGEST = 2048  # bytes of a request's first line; a longer one goes to no room
_LINE = re.compile(rb"[A-Z]{1,16} ([\x21-\x7e]+) HTTP/1\.[01]\r?")
_BEGINS = re.compile(rb"[A-Z]{1,16}(?: [\x21-\x7e]*(?: [HTP/1.0]{0,8}\r?)?)?")


def target_of(seen: bytes) -> str | None:
    """Return the target (path and query) in the first bytes of a request.

    Args:
        seen: First bytes of the connection.

    Returns:
        Target; empty if no request can begin with these bytes; None while the first line is
        incomplete.
    """
    line, end, _ = seen[:LARGEST].partition(b"\n")
    if end:
        match = _LINE.fullmatch(line)
        return match[1].decode("ascii") if match is not None else ""
    if len(seen) >= LARGEST or (seen and _BEGINS.fullmatch(seen) is None):
        return ""
    return None


class Site:
    """HTTP service of the server itself, for the connections that no room takes.

    Args:
        settings: Settings that all rooms share.
        limiter: Limiter of this site alone; the acceptors have another limiter.
        rooms: Returns the states of all rooms.
        left: Called with the source of each connection that has ended.
        listed: Whether anybody may know which rooms there are.
    """

    def __init__(
        self,
        settings: ServerSettings,
        limiter: ConnectionLimiter,
        rooms: Callable[[], Awaitable[Sequence[RoomState]]],
        left: Callable[[str], None],
        *,
        listed: bool = True,
    ) -> None:
        self._check, self._base = HostCheck(settings), settings.base_path
        self._limiter, self._rooms, self._left = limiter, rooms, left
        self._listed = listed
        self._handed: dict[int, str] = {}
        self._numbers = itertools.count(1)
        self._acceptor: socket.socket | None = None
        self._listener: Listener | None = None

    async def start(self) -> None:
        """Start to serve the connections that are handed over."""
        self._acceptor, inner = handing_pair()
        acceptor = HandedAcceptor(inner, self._limiter, self._ended)
        self._listener = await serve_acceptors(
            self._handle, self._process, [acceptor], self._limiter, base=self._base
        )

    def stop(self) -> None:
        """Stop serving, and close all connections."""
        if self._listener is not None:
            self._listener.close()
        if self._acceptor is not None:
            self._acceptor.close()

    def take(self, connection: socket.socket, source: str) -> bool:
        """Hand a connection to this site; return whether it was handed over."""
        number = next(self._numbers)
        if self._acceptor is None or not hand_over(self._acceptor, connection, number, source):
            return False
        self._handed[number] = source
        return True

    def _ended(self, number: int) -> None:
        source = self._handed.pop(number, None)
        if source is not None:
            self._left(source)

    async def _process(self, connection: ServerConnection, request: HttpRequest) -> Response | None:
        assert isinstance(connection, Wire)
        refusal = connection.come_from(request.headers)
        if refusal is not None:
            return response(too_many(plain(request), refusal))
        refused = self._check(connection, request)
        if refused is not None or "Upgrade" in request.headers:
            return refused
        connection.close_timeout = DOWNLOAD_TIMEOUT
        rooms, base = await self._rooms(), self._base
        return response(answer(plain(request), rooms, listed=self._listed, base=base))

    async def _handle(self, ws: Wire) -> None:
        target = "" if ws.request is None else ws.request.path
        code, why = turned_away(target, await self._rooms(), listed=self._listed)
        await refuse(ws, code, why)
