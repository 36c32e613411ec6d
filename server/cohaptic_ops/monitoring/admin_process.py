"""The process of an admin port: reads the reports of a server, and answers HTTP requests.

A separate process serves the port, so that requests never delay a tick of the server, and get an
answer even if the server hangs.

`answer` makes the response to a request without I/O.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import signal
import socket
from collections.abc import Sequence
from dataclasses import replace
from typing import Any
from urllib.parse import parse_qs

from prometheus_client.exposition import CONTENT_TYPE_LATEST
from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request as HttpRequest
from websockets.http11 import Response

from cohaptic.clock import SystemClock
from cohaptic.errors import SettingError
from cohaptic.runtime.scheduling import stand_back
from cohaptic_ops.monitoring.exposition import exposition
from cohaptic_ops.monitoring.json_lines import BadLine
from cohaptic_ops.monitoring.known import NO_ROOM, Known
from cohaptic_ops.monitoring.lines import (
    LONGEST,
    OpenLine,
    RefusedLine,
    decode,
    encode,
)
from cohaptic_server.guard.limits import Limits
from cohaptic_server.http.routes import Answer, Request, page, text
from cohaptic_server.settings import ServerSettings
from cohaptic_server.shell.http import DOWNLOAD_TIMEOUT, HostCheck, plain, response
from cohaptic_server.shell.limiter import ConnectionLimiter
from cohaptic_server.shell.listener import open_acceptors, serve_acceptors, url_of
from cohaptic_server.shell.wire import Wire


def serve_admin(end: socket.socket, host: str, port: int, allow_hosts: tuple[str, ...]) -> None:
    """Serve an admin port until the server ends; the main function of the process.

    Args:
        end: One end of a socket pair; the server writes lines into the other end.
        host, port: Address and port to listen on.
        allow_hosts: Further host names that requests may use.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the server ends this process
    logging.basicConfig(level=logging.CRITICAL)  # log lines about requests could fill a disk
    with contextlib.suppress(OSError):
        stand_back()
    asyncio.run(_serve(end, host, port, allow_hosts))


async def _serve(end: socket.socket, host: str, port: int, allow_hosts: tuple[str, ...]) -> None:
    end.setblocking(False)
    reader, writer = await asyncio.open_connection(sock=end, limit=LONGEST)
    clock, known = SystemClock(), Known()
    missing: list[str] = []
    limiter = ConnectionLimiter(Limits(), clock)

    async def process(connection: ServerConnection, request: HttpRequest) -> Response | None:
        refused = check(connection, request)
        if refused is not None:
            return refused
        connection.close_timeout = DOWNLOAD_TIMEOUT
        # A request for a websocket gets a normal response, too: there are no websockets here.
        return response(answer(plain(request), known, clock.now()))

    async def nobody(_: Wire) -> None:
        """Handle a websocket; this is never called, since no request becomes one."""

    try:
        settings = ServerSettings(host, port, allow_hosts=allow_hosts, room=None)
        check = HostCheck(settings)
        acceptors = await open_acceptors(settings, limiter, missing.append)
    except SettingError as error:
        refusal = RefusedLine(name=error.name, value=str(error.value), limit=error.limit)
        writer.write(encode(refusal))
        await writer.drain()
        return
    listener = await serve_acceptors(nobody, process, acceptors, limiter)
    url = url_of(host, acceptors[0]).replace("ws", "http", 1)
    writer.write(encode(OpenLine(url=url, missing=tuple(missing))))
    # A read error or an invalid line means that the server has ended or is broken.
    with contextlib.suppress(OSError, ValueError, BadLine):
        while line := await reader.readline():
            known.take(decode(line), clock.now())
    listener.close()
    writer.close()


_JSON = "application/json"
INDEX = (
    "The admin port of a cohaptic server.\n\n"
    "/metrics  for Prometheus\n"
    "/healthz  whether the server is alive\n"
    "/readyz   whether people may be sent here; ?room=NAME for one room\n"
    "/status   everything as JSON; cohaptic top shows it\n"
)


def answer(request: Request, known: Known, now: float) -> Answer:
    """Return the response to a request; the client may be anybody who reaches the port.

    Args:
        request: Method and target of the request.
        known: State of the server according to its reports so far.
        now: Time [s].
    """
    if request.method not in ("GET", "HEAD"):
        message = f"{request.method[:16]} is not served here; GET and HEAD are\n"
        return text(request, 405, "Method Not Allowed", message, ("Allow", "GET, HEAD"))
    path, _, query = request.target.partition("#")[0].partition("?")
    if path == "/":
        return text(request, 200, "OK", INDEX)
    if path == "/metrics":
        return page(request, CONTENT_TYPE_LATEST, exposition(known, now))
    if path == "/healthz":
        return _verdict(request, known.why_not_alive(now))
    if path == "/readyz":
        asked = parse_qs(query, keep_blank_values=True, max_num_fields=None).get("room")
        why = known.why_not_ready(now, asked[0] if asked else None)
        found = _verdict(request, why, known.why_not_ticking(now))
        return replace(found, status=404, phrase="Not Found") if why == [NO_ROOM] else found
    if path == "/status":
        return page(request, _JSON, _encode(status(known, now)))
    return text(request, 404, "Not Found", "there is nothing of this name here\n")


def status(known: Known, now: float) -> dict[str, Any]:
    """Return everything that is known about the server as a JSON object, for programs."""
    health, idle = known.health, known.why_not_ticking(now)
    rooms: list[dict[str, Any]] = []
    for room in () if health is None else health.rooms:
        reported = known.rooms.get(room.name)
        rooms.append(
            room.model_dump()
            | {
                "ticking": room.name not in idle,
                "age": None if reported is None else round(now - reported.heard, 3),
                "metrics": None if reported is None else reported.metrics.model_dump(),
            }
        )
    return {
        "version": "" if health is None else health.version,
        "alive": not known.why_not_alive(now),
        "ready": not known.why_not_ready(now),
        "draining": health is not None and health.draining,
        "reasons": known.why_not_ready(now),
        "connections": 0 if health is None else health.connections,
        "refused": 0 if health is None else health.refused,
        "cluster": health.cluster.model_dump() if health and health.cluster else None,
        "rooms": rooms,
    }


def _verdict(request: Request, why: Sequence[str], idle: dict[str, str] | None = None) -> Answer:
    reported: dict[str, Any] = {"ok": not why, "reasons": list(why)}
    if idle is not None:
        reported["not_ticking"] = idle
    answered = page(request, _JSON, _encode(reported))
    return answered if not why else replace(answered, status=503, phrase="Service Unavailable")


def _encode(reported: dict[str, Any]) -> bytes:
    return json.dumps(reported, indent=1).encode() + b"\n"
