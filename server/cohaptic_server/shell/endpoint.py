"""Further kinds of websocket connections, beside those of users and watchers."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import dataclass

from cohaptic_server.shell.wire import Wire

LEAVING = 5.0  # s
SETTLING = 0.5  # s to return when the server ends; less than the server waits for closing clients


@dataclass(frozen=True, slots=True)
class Endpoint:
    """A further kind of connection, which a client requests by its subprotocol.

    Args:
        serve: Serves one connection. After the connection has closed, `serve` is cancelled if it
            has not returned within `leaving`.
        longest: Largest message that a client may send [bytes].
        own_page_only: Whether only clients on the server's machine are let in: programs, the
            server's own page and pages of `--allow-origin`. If not, origin and host are checked as
            for the pages of users. No client needs a token in either case.
        as_fast_as_served: Whether a client may send as much as `serve` takes. If not, the rate
            limits of a user's messages apply.
        leaving: Time for `serve` to return after the close [s]; None if `serve` ends by itself.
    """

    serve: Callable[[Wire], Awaitable[None]]
    longest: int
    own_page_only: bool = True
    as_fast_as_served: bool = False
    leaving: float | None = LEAVING
