"""Opens the port of a server and serves its connections."""

from __future__ import annotations

import asyncio
import asyncio.sslproto
import errno
import logging
import socket
import ssl
from collections.abc import Awaitable, Callable, Collection, Sequence
from functools import partial
from typing import Any

from websockets.asyncio.server import Server, ServerConnection, serve
from websockets.http11 import Request, Response
from websockets.typing import Subprotocol

from cohaptic.errors import SettingError
from cohaptic.protocol.version import FAMILY, SUBPROTOCOL
from cohaptic.room_address import below
from cohaptic.runtime.transport import WEBSOCKET_OPTIONS
from cohaptic_server.http.routes import moved, query_without_token
from cohaptic_server.settings import ServerSettings
from cohaptic_server.shell.acceptor import Acceptor
from cohaptic_server.shell.http import DOWNLOAD_TIMEOUT, plain, response, too_many
from cohaptic_server.shell.limiter import ConnectionLimiter
from cohaptic_server.shell.wire import HEAD_TIMEOUT, MAX_INBOUND_BYTES, Wire

TLS_BUFFER = 16 * 1024
# In s: the handshake has the time-out of the request; a peer that is slow to shut down is cut off.
TLS_OPTIONS = {"ssl_handshake_timeout": HEAD_TIMEOUT, "ssl_shutdown_timeout": 2.0}
_ALL_INTERFACES = ("0.0.0.0", "::")
# Errors if this machine lacks an address of the host name, or the address family: many machines
# have ::1 in their hosts file and IPv6 switched off.
_NOT_HERE = (errno.EADDRNOTAVAIL, errno.EAFNOSUPPORT, errno.EPROTONOSUPPORT)
log = logging.getLogger("cohaptic.server")


class Listener:
    """The running websocket servers on all addresses of one server.

    Args:
        servers: Servers of the websockets library, one for each address.
    """

    def __init__(self, servers: Sequence[Server]) -> None:
        self._servers = servers

    def close(self) -> None:
        """Accept no more connections, and close the open ones."""
        for server in self._servers:
            server.close()

    async def wait_closed(self) -> None:
        """Wait until all connections are closed."""
        await asyncio.gather(*(server.wait_closed() for server in self._servers))


async def listen(
    handle: Callable[[Wire], Awaitable[None]],
    process: Callable[[ServerConnection, Request], Awaitable[Response | None]],
    settings: ServerSettings,
    limiter: ConnectionLimiter,
    tls: ssl.SSLContext | None = None,
    acceptor: socket.socket | None = None,
    further: Collection[str] = (),
) -> tuple[Listener, str]:
    """Open the port and serve its connections; return the listener and its URL.

    Args:
        handle: Serves a websocket, which is closed when `handle` returns.
        process: Answers an HTTP request; returns None to let it become a websocket.
        settings: Settings of the server, with host, port and base path.
        limiter: Limiter that admits connections.
        tls: TLS settings of every connection; None without TLS.
        acceptor: Listening socket to use in place of a new port; None opens the port.
        further: Subprotocols that the server accepts beside its own.

    Raises:
        SettingError: The address or port is not available.
    """
    secure = tls is not None
    acceptors = (
        await open_acceptors(settings, limiter, tls=secure) if acceptor is None else [acceptor]
    )
    listener = await serve_acceptors(
        handle, process, acceptors, limiter, tls, settings.base_path, further
    )
    return listener, url_of(settings.host, acceptors[0], tls=secure)


async def serve_acceptors(
    handle: Callable[[Wire], Awaitable[None]],
    process: Callable[[ServerConnection, Request], Awaitable[Response | None]],
    acceptors: Sequence[socket.socket],
    limiter: ConnectionLimiter,
    tls: ssl.SSLContext | None = None,
    base: str = "",
    further: Collection[str] = (),
) -> Listener:
    """Serve the connections of listening sockets that are open already.

    Args:
        handle: Serves a websocket, which is closed when `handle` returns.
        process: Answers an HTTP request; returns None to let it become a websocket.
        tls: TLS settings of every connection; None without TLS.
        base: Path prefix that requests may have; `handle` and `process` see the path without it.
        further: Subprotocols that the server accepts beside its own.
    """

    async def handle_wire(connection: ServerConnection) -> None:
        assert isinstance(connection, Wire)
        await handle(connection)

    async def process_below(connection: ServerConnection, request: Request) -> Response | None:
        inner = below(request.path, base)
        if base and inner[:1] in ("", "?") and "Upgrade" not in request.headers:
            assert isinstance(connection, Wire)
            refusal = connection.come_from(request.headers)
            if refusal is not None:
                return response(too_many(plain(request), refusal))
            # Relative addresses of the page begin behind the last slash.
            location = f"{base.rpartition('/')[2]}/{query_without_token(inner)}"
            return response(moved(plain(request), location))
        # Changed in place, since the library gives this same request object to the websocket.
        request.path = inner
        return await process(connection, request)

    options: dict[str, Any] = WEBSOCKET_OPTIONS | {"open_timeout": DOWNLOAD_TIMEOUT + 5.0}
    if tls is not None:
        options |= TLS_OPTIONS
        # asyncio keeps 256 KiB for each connection; a TLS record has 16 KiB.
        asyncio.sslproto.SSLProtocol.max_size = TLS_BUFFER
    wire: Any = partial(Wire, limiter=limiter)  # the library's type is a class, which it only calls
    servers = [
        await serve(
            handle_wire,
            sock=acceptor,
            process_request=process_below,
            subprotocols=[Subprotocol(SUBPROTOCOL)],
            # A client without our subprotocol then gets an error message instead of a bare 400.
            select_subprotocol=partial(_select_subprotocol, further),
            server_header=None,
            max_size=MAX_INBOUND_BYTES,
            create_connection=wire,
            ssl=tls,
            **options,
        )
        for acceptor in acceptors
    ]
    return Listener(servers)


async def open_acceptors(
    settings: ServerSettings,
    limiter: ConnectionLimiter,
    tell: Callable[[str], None] = log.warning,
    *,
    tls: bool = False,
) -> list[Acceptor]:
    """Open a listening socket on each address of the server's host name that this machine has.

    Args:
        settings: Settings of the server, with host and port.
        limiter: Limiter that admits connections.
        tell: Called with a sentence for each address of the name that this machine does not have.
        tls: Whether connections begin with a TLS handshake.

    Raises:
        SettingError: The machine has none of the addresses, or the port is in use on one of them.
    """
    host, port = settings.host, settings.port
    try:
        acceptors, missing = await _acceptors(host, port, limiter, tls=tls)
        for address, error in missing.items():
            whose = host or "this machine"
            tell(f"nobody comes in by {address}, an address of {whose}: {error}")
        return acceptors
    except OSError as error:
        if error.errno == errno.EADDRINUSE:
            free = "a free one: stop the other server, or choose with --port"
            raise SettingError("port", f"{port}, which is in use on {host}", free) from error
        raise SettingError("address", f"{host}:{port} ({error})", "one of this machine") from error


def url_of(host: str, acceptor: socket.socket, *, tls: bool = False) -> str:
    """Return the URL of a server that listens on `acceptor`; a unix socket's URL has no port."""
    name = f"[{host}]" if ":" in host else host
    address = acceptor.getsockname()
    scheme = "wss" if tls else "ws"
    return f"{scheme}://{name}:{address[1]}" if isinstance(address, tuple) else f"{scheme}://{name}"


async def _acceptors(
    host: str, port: int, limiter: ConnectionLimiter, *, tls: bool
) -> tuple[list[Acceptor], dict[str, OSError]]:
    """Open listening sockets on the addresses of a host name, all on one port; raises OSError.

    Returns:
        The sockets, and the error of each address that this machine does not have.
    """
    loop = asyncio.get_running_loop()
    found = await loop.getaddrinfo(
        host or None, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
    )
    acceptors: list[Acceptor] = []
    missing: dict[str, OSError] = {}
    try:
        for family, _, _, _, address in dict.fromkeys(found):
            if acceptors:  # with port 0 the system has chosen the port of the first socket
                address = (address[0], acceptors[0].getsockname()[1], *address[2:])
            try:
                acceptors.append(Acceptor.opened(address, family, limiter, loop, tls=tls))
            except OSError as error:
                # A port in use belongs to another server; clients that connect by the name would
                # reach sometimes this server and sometimes that one.
                if error.errno not in _NOT_HERE:
                    raise
                missing[str(address[0])] = error
        if not acceptors:
            raise next(iter(missing.values()))
    except OSError:
        for acceptor in acceptors:
            acceptor.close()
        raise
    return acceptors, missing


def page_address(url: str) -> str:
    """Return the address of the web page of the server at `url`, for a browser on this machine."""
    scheme, _, rest = url.partition("://")
    host, _, port = rest.rpartition(":")
    name = "localhost" if host.strip("[]") in _ALL_INTERFACES else host
    return f"{scheme.replace('ws', 'http', 1)}://{name}:{port}/"


def _select_subprotocol(
    further: Collection[str], _connection: ServerConnection, offered: Sequence[Subprotocol]
) -> Subprotocol | None:
    """Return the subprotocol to use: a further one, ours, or another version of ours.

    With another version the connection is opened, so that a browser can show why it is refused.
    """
    if (special := next((name for name in offered if name in further), None)) is not None:
        return special
    others = (name for name in offered if name.startswith(FAMILY))
    return Subprotocol(SUBPROTOCOL) if SUBPROTOCOL in offered else next(others, None)
