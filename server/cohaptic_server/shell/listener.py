"""Opening of the port, or an error that says how to get one."""

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
from cohaptic_server.shell.doors.door import Door
from cohaptic_server.shell.gate import Gate
from cohaptic_server.shell.http import DOWNLOAD_TIMEOUT, plain, response, too_many
from cohaptic_server.shell.wire import HEAD_TIMEOUT, MAX_INBOUND_BYTES, Wire

TLS_BUFFER = 16 * 1024
# s, as for the request; and for the last word of one who goes, after which it is cut.
TLS_OPTIONS = {"ssl_handshake_timeout": HEAD_TIMEOUT, "ssl_shutdown_timeout": 2.0}
_ALL_INTERFACES = ("0.0.0.0", "::")
# An address of a name is none of this machine, or of a kind that it does not have: IPv6 is switched
# off on many whose hosts file has ::1.
_NOT_HERE = (errno.EADDRNOTAVAIL, errno.EAFNOSUPPORT, errno.EPROTONOSUPPORT)
log = logging.getLogger("cohaptic.server")


class Listener:
    """All addresses of one server.

    Args:
        servers: The library's, one for each address.
    """

    def __init__(self, servers: Sequence[Server]) -> None:
        self._servers = servers

    def close(self) -> None:
        """Take nobody any more, and close whoever is there."""
        for server in self._servers:
            server.close()

    async def wait_closed(self) -> None:
        """Wait until everybody has gone."""
        await asyncio.gather(*(server.wait_closed() for server in self._servers))


async def listen(
    handle: Callable[[Wire], Awaitable[None]],
    process: Callable[[ServerConnection, Request], Awaitable[Response | None]],
    settings: ServerSettings,
    gate: Gate,
    tls: ssl.SSLContext | None = None,
    door: socket.socket | None = None,
    further: Collection[str] = (),
) -> tuple[Listener, str]:
    """Open the port with the options of every websocket; returns the listener and its URL.

    Args:
        handle: Serves a websocket until it returns.
        process: Answers an HTTP request; None lets it become a websocket.
        settings: Settings of the server.
        gate: Who may come in.
        tls: TLS settings of every connection; None without TLS.
        door: Accepts connections in place of the port.
        further: Subprotocols that the server takes besides its own.

    Raises:
        SettingError: The address or port cannot be had.
    """
    secure = tls is not None
    doors = await open_doors(settings, gate, tls=secure) if door is None else [door]
    listener = await serve_doors(handle, process, doors, gate, tls, settings.base_path, further)
    return listener, url_of(settings.host, doors[0], tls=secure)


async def serve_doors(
    handle: Callable[[Wire], Awaitable[None]],
    process: Callable[[ServerConnection, Request], Awaitable[Response | None]],
    doors: Sequence[socket.socket],
    gate: Gate,
    tls: ssl.SSLContext | None = None,
    base: str = "",
    further: Collection[str] = (),
) -> Listener:
    """Serve whoever comes through some doors; arguments as for `listen`.

    Args:
        handle, process, doors, gate, tls, further: The same.
        base: Path that all requests may be below; who reads them later sees nothing of it.
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
        # In place: the library keeps this very request, for whoever serves the websocket.
        request.path = inner
        return await process(connection, request)

    options: dict[str, Any] = WEBSOCKET_OPTIONS | {"open_timeout": DOWNLOAD_TIMEOUT + 5.0}
    if tls is not None:
        options |= TLS_OPTIONS
        # asyncio keeps 256 KiB for each connection; a frame of TLS has 16.
        asyncio.sslproto.SSLProtocol.max_size = TLS_BUFFER
    wire: Any = partial(Wire, gate=gate)  # the library asks for a class, and calls it
    servers = [
        await serve(
            handle_wire,
            sock=door,
            process_request=process_below,
            subprotocols=[Subprotocol(SUBPROTOCOL)],
            # A client without our subprotocol gets an error message from its session, not just 400.
            select_subprotocol=partial(_select_subprotocol, further),
            server_header=None,
            max_size=MAX_INBOUND_BYTES,
            create_connection=wire,
            ssl=tls,
            **options,
        )
        for door in doors
    ]
    return Listener(servers)


async def open_doors(
    settings: ServerSettings,
    gate: Gate,
    tell: Callable[[str], None] = log.warning,
    *,
    tls: bool = False,
) -> list[Door]:
    """Sockets that listen on all addresses of a server that this machine has.

    Args:
        settings: Settings of the server.
        gate: Who may come in.
        tell: Hears of each address of its name that the machine does not have.
        tls: Whether connections begin with a handshake.

    Raises:
        SettingError: It has none of them, or the port is in use on one.
    """
    host, port = settings.host, settings.port
    try:
        doors, missing = await _doors(host, port, gate, tls=tls)
        for address, error in missing.items():
            whose = host or "this machine"
            tell(f"nobody comes in by {address}, an address of {whose}: {error}")
        return doors
    except OSError as error:
        if error.errno == errno.EADDRINUSE:
            free = "a free one: stop the other server, or choose with --port"
            raise SettingError("port", f"{port}, which is in use on {host}", free) from error
        raise SettingError("address", f"{host}:{port} ({error})", "one of this machine") from error


def url_of(host: str, door: socket.socket, *, tls: bool = False) -> str:
    """Address of a server that listens at a door; without a port if it is handed connections."""
    name = f"[{host}]" if ":" in host else host
    address = door.getsockname()
    scheme = "wss" if tls else "ws"
    return f"{scheme}://{name}:{address[1]}" if isinstance(address, tuple) else f"{scheme}://{name}"


async def _doors(
    host: str, port: int, gate: Gate, *, tls: bool
) -> tuple[list[Door], dict[str, OSError]]:
    """Sockets that listen on the addresses of a name, on one port; raises OSError.

    Returns:
        They, and the addresses that are not here, with why.
    """
    loop = asyncio.get_running_loop()
    found = await loop.getaddrinfo(
        host or None, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
    )
    doors: list[Door] = []
    missing: dict[str, OSError] = {}
    try:
        for family, _, _, _, address in dict.fromkeys(found):
            if doors:  # the system chose the port of the first
                address = (address[0], doors[0].getsockname()[1], *address[2:])
            try:
                doors.append(Door.opened(address, family, gate, loop, tls=tls))
            except OSError as error:
                # A port that is in use is another server's, and who comes by the name would meet
                # now this one and now that.
                if error.errno not in _NOT_HERE:
                    raise
                missing[str(address[0])] = error
        if not doors:
            raise next(iter(missing.values()))
    except OSError:
        for door in doors:
            door.close()
        raise
    return doors, missing


def page_address(url: str) -> str:
    """Address of the page of the server at `url`, for a browser on this machine."""
    scheme, _, rest = url.partition("://")
    host, _, port = rest.rpartition(":")
    name = "localhost" if host.strip("[]") in _ALL_INTERFACES else host
    return f"{scheme.replace('ws', 'http', 1)}://{name}:{port}/"


def _select_subprotocol(
    further: Collection[str], _connection: ServerConnection, offered: Sequence[Subprotocol]
) -> Subprotocol | None:
    """Our subprotocol or another version of it; a browser that gets none hears no reason."""
    if (special := next((name for name in offered if name in further), None)) is not None:
        return special
    others = (name for name in offered if name.startswith(FAMILY))
    return Subprotocol(SUBPROTOCOL) if SUBPROTOCOL in offered else next(others, None)
