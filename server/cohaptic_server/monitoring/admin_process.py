"""The process of an admin port: hears lines of a server, and answers requests about it.

It is a process of its own, so that no request about a server costs that server a tick, and so
that there is an answer when the server hangs.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import signal
import socket

from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request as HttpRequest
from websockets.http11 import Response

from cohaptic.clock import SystemClock
from cohaptic.errors import SettingError
from cohaptic.runtime.scheduling import stand_back
from cohaptic_server.guard.limits import Limits
from cohaptic_server.monitoring.json_lines import BadLine
from cohaptic_server.monitoring.known import Known
from cohaptic_server.monitoring.lines import (
    LONGEST,
    OpenLine,
    RefusedLine,
    decode,
    encode,
)
from cohaptic_server.monitoring.pages import answer
from cohaptic_server.settings import ServerSettings
from cohaptic_server.shell.gate import Gate
from cohaptic_server.shell.http import DOWNLOAD_TIMEOUT, HostCheck, plain, response
from cohaptic_server.shell.listener import open_doors, serve_doors, url_of
from cohaptic_server.shell.wire import Wire


def serve_admin(end: socket.socket, host: str, port: int, allow_hosts: tuple[str, ...]) -> None:
    """Main function of the process; it ends when the server does.

    Args:
        end: Of a pair; the server writes lines into the other.
        host, port: Where to listen.
        allow_hosts: Further names under which it may be asked.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the server ends it
    logging.basicConfig(level=logging.CRITICAL)  # what is said about requests would fill a disk
    with contextlib.suppress(OSError):
        stand_back()
    asyncio.run(_serve(end, host, port, allow_hosts))


async def _serve(end: socket.socket, host: str, port: int, allow_hosts: tuple[str, ...]) -> None:
    end.setblocking(False)
    reader, writer = await asyncio.open_connection(sock=end, limit=LONGEST)
    clock, known = SystemClock(), Known()
    missing: list[str] = []
    gate = Gate(Limits(), clock)

    async def process(connection: ServerConnection, request: HttpRequest) -> Response | None:
        refused = check(connection, request)
        if refused is not None:
            return refused
        connection.close_timeout = DOWNLOAD_TIMEOUT
        # Also to one who asks for a websocket: there is none here.
        return response(answer(plain(request), known, clock.now()))

    async def nobody(_: Wire) -> None:
        """No request becomes a websocket."""

    try:
        settings = ServerSettings(host, port, allow_hosts=allow_hosts, room=None)
        check = HostCheck(settings)
        doors = await open_doors(settings, gate, missing.append)
    except SettingError as error:
        refusal = RefusedLine(name=error.name, value=str(error.value), limit=error.limit)
        writer.write(encode(refusal))
        await writer.drain()
        return
    listener = await serve_doors(nobody, process, doors, gate)
    url = url_of(host, doors[0]).replace("ws", "http", 1)
    writer.write(encode(OpenLine(url=url, missing=tuple(missing))))
    # Anything else but a line is the end of the server, or of its mind.
    with contextlib.suppress(OSError, ValueError, BadLine):
        while line := await reader.readline():
            known.take(decode(line), clock.now())
    listener.close()
    writer.close()
