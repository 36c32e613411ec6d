"""Kinds of websocket connections that a server takes beside those of hands and watchers."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import dataclass

from cohaptic_server.shell.wire import Wire


@dataclass(frozen=True, slots=True)
class Endpoint:
    """A kind of connection, which a client asks for by its subprotocol.

    Args:
        serve: Serves one connection until it returns. It has to bound what it takes and keeps, as
            nothing of a message is checked before.
        longest: Largest message that a client may send [bytes].
        own_page_only: Whether only the server's own page and programs of the same machine are let
            in; others are let in where a hand would be.
    """

    serve: Callable[[Wire], Awaitable[None]]
    longest: int
    own_page_only: bool = True
