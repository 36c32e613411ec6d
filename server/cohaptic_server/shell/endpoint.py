"""Kinds of websocket connections that a server takes beside those of hands and watchers."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import dataclass

from cohaptic_server.shell.wire import Wire

LEAVING = 5.0  # s
SETTLING = 0.5  # s for a server that ends; less than it waits for clients to answer its close


@dataclass(frozen=True, slots=True)
class Endpoint:
    """A kind of connection, which a client asks for by its subprotocol.

    Args:
        serve: Serves one connection. Once the connection has closed it has `leaving` to return,
            and is cancelled then.
        longest: Largest message that a client may send [bytes].
        own_page_only: Whether only programs of the server's machine, its own page there and those
            of `--allow-origin` there are let in. Others are let in by origin and host, as pages
            are; nobody is asked for a token.
        as_fast_as_served: Whether a client may send as much as `serve` takes. Otherwise its
            messages spend the same budgets as those of a hand.
        leaving: Time for `serve` to return after the close [s]; None where it ends by itself.
    """

    serve: Callable[[Wire], Awaitable[None]]
    longest: int
    own_page_only: bool = True
    as_fast_as_served: bool = False
    leaving: float | None = LEAVING
