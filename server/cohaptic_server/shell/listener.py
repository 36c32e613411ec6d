"""Opening of the port, or an error that says how to get one."""

from __future__ import annotations

import errno
from collections.abc import Awaitable, Callable, Sequence
from typing import Any

from websockets.asyncio.server import Server, ServerConnection, serve
from websockets.http11 import Request, Response
from websockets.typing import Subprotocol

from cohaptic.errors import SettingError
from cohaptic.protocol.upload_messages import SUBPROTOCOL as UPLOAD
from cohaptic.protocol.version import FAMILY, SUBPROTOCOL
from cohaptic.runtime.transport import WEBSOCKET_OPTIONS
from cohaptic_server.settings import ServerSettings
from cohaptic_server.shell.http import DOWNLOAD_TIMEOUT
from cohaptic_server.shell.wire import MAX_INBOUND_BYTES, Wire

_ALL_INTERFACES = ("0.0.0.0", "::")


async def listen(
    handle: Callable[[Wire], Awaitable[None]],
    process: Callable[[ServerConnection, Request], Awaitable[Response | None]],
    settings: ServerSettings,
) -> tuple[Server, str]:
    """Open the port with the options of every websocket; returns the listener and its URL.

    Args:
        handle: Serves a websocket until it returns.
        process: Answers an HTTP request; None lets it become a websocket.
        settings: Of the server.

    Raises:
        SettingError: The address or port cannot be had.
    """

    async def handle_wire(connection: ServerConnection) -> None:
        assert isinstance(connection, Wire)
        await handle(connection)

    host, port = settings.host, settings.port
    options: dict[str, Any] = WEBSOCKET_OPTIONS | {"open_timeout": DOWNLOAD_TIMEOUT + 5.0}
    try:
        listener = await serve(
            handle_wire,
            host,
            port,
            process_request=process,
            subprotocols=[Subprotocol(SUBPROTOCOL)],
            # A client without our subprotocol gets an error message from its session, not just 400.
            select_subprotocol=_select_subprotocol,
            server_header=None,
            max_size=MAX_INBOUND_BYTES,
            create_connection=Wire,
            **options,
        )
    except OSError as error:
        if error.errno == errno.EADDRINUSE:
            free = "a free one: stop the other server, or choose with --port"
            raise SettingError("port", f"{port}, which is in use on {host}", free) from error
        raise SettingError("address", f"{host}:{port} ({error})", "one of this machine") from error
    name = f"[{host}]" if ":" in host else host
    return listener, f"ws://{name}:{next(iter(listener.sockets)).getsockname()[1]}"


def page_address(url: str) -> str:
    """Address of the page of the server at `url`, for a browser on this machine."""
    scheme, _, rest = url.partition("://")
    host, _, port = rest.rpartition(":")
    name = "localhost" if host.strip("[]") in _ALL_INTERFACES else host
    return f"{scheme.replace('ws', 'http', 1)}://{name}:{port}/"


def _select_subprotocol(
    _connection: ServerConnection, offered: Sequence[Subprotocol]
) -> Subprotocol | None:
    """Our subprotocol or another version of it; a browser that gets none hears no reason."""
    if UPLOAD in offered:
        return Subprotocol(UPLOAD)
    others = (name for name in offered if name.startswith(FAMILY))
    return Subprotocol(SUBPROTOCOL) if SUBPROTOCOL in offered else next(others, None)
