"""Sends a session, while it is recorded, to a program elsewhere that keeps the file.

Whoever may record needs a token with `roomRecord` or `roomAdmin`; on a server without access
control, a program of the same machine.
"""

from __future__ import annotations

import asyncio
import ipaddress
import logging
from collections.abc import AsyncGenerator
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from websockets.exceptions import ConnectionClosed

from cohaptic.errors import CloseCode, CohapticError, ProtocolError, RemoteProtocolError
from cohaptic.protocol.messages import Mark
from cohaptic.sessions.entries import LeftOut, SessionInfo, Written, size_of
from cohaptic.sessions.stream import (
    EndRecording,
    RecordRequest,
    decode_request,
    encode_batch,
)
from cohaptic_server.access.keys import forbidden
from cohaptic_server.shell.endpoint import Endpoint
from cohaptic_server.shell.refusal import refuse
from cohaptic_server.shell.wire import Wire

if TYPE_CHECKING:
    from cohaptic_server.shell.server import CohapticServer

log = logging.getLogger("cohaptic.server")

# Bytes of entries that may wait for a slow path, as for a slow disk (`sessions/recorder.py`).
_WAITING = 64 * 1024 * 1024
_TICKS = 3  # between two messages; what comes meanwhile takes a millisecond or two to encode
_LOOK = 0.5  # s after which a message leaves without a tick: of a room that sleeps
_GREETING = 10.0  # s for the first message
_LONGEST = 4096  # bytes of a message of the program


class SentAway:
    """Takes the entries of a session, and gives them to its connection; the oldest come first.

    Args:
        info: First entry.
        to: Address of the program, for the log.

    Attributes:
        due: Set when entries are to leave.
    """

    def __init__(self, info: SessionInfo, to: str) -> None:
        self.path = Path(f"program at {to}")
        self.ended = False
        self._waiting: list[Written] = [info]
        self._size = 0
        self._left_out = 0
        self._newest = info.t
        self._ticks = 0
        self.due = asyncio.Event()

    def add(self, entry: Written) -> None:
        """Add an entry without waiting; one that is too much is left out, and counted."""
        if self.ended:
            return
        size, self._newest = size_of(entry), entry.t
        if self._size + size > _WAITING:
            self._left_out += 1
            return
        if self._left_out:
            self._waiting.append(LeftOut(entry.t, self._left_out))
            self._left_out = 0
        self._waiting.append(entry)
        self._size += size

    def wake(self) -> None:
        """Say that a tick is over; after every third the entries leave."""
        self._ticks += 1
        if self._ticks % _TICKS == 0:
            self.due.set()

    def take(self) -> list[Written]:
        """Remove and return the entries that wait."""
        waiting, self._waiting, self._size = self._waiting, [], 0
        return waiting

    def finish(self) -> str:
        """End it; return a sentence for the log."""
        self.ended = True
        if self._left_out:
            self._waiting.append(LeftOut(self._newest, self._left_out))
            self._left_out = 0
        return f"the recording for the {self.path} has ended"


class RecordingDesk:
    """Serves the programs that keep recordings of one server.

    Args:
        server: The server.
    """

    def __init__(self, server: CohapticServer) -> None:
        self._server = server

    @property
    def endpoint(self) -> Endpoint:
        """Kind of connection that the desk serves, for `CohapticServer.add_endpoint`."""
        return Endpoint(self.serve, _LONGEST, own_page_only=False)

    async def serve(self, ws: Wire) -> None:
        """Serve one connection to its end."""
        try:
            await self._serve(ws)
            await ws.close(1000)
        except ProtocolError as error:
            await refuse(ws, error.code, str(error))
        except CohapticError as error:
            await refuse(ws, CloseCode.FORBIDDEN, str(error))
        except TimeoutError:
            await refuse(ws, CloseCode.HELLO_TIMEOUT, f"no request within {_GREETING:g} s")
        except ConnectionClosed:
            pass

    async def _serve(self, ws: Wire) -> None:
        async with asyncio.timeout(_GREETING):
            requests = _requests(ws)
            first = await anext(requests)
        if not isinstance(first, RecordRequest):
            raise RemoteProtocolError("message", type(first).__name__, "RecordRequest")
        self._check(first, ws)
        recordings = self._server.recordings
        made: list[SentAway] = []

        def open_one(info: SessionInfo) -> SentAway:
            made.append(SentAway(info, ws.source))
            return made[0]

        await recordings.begin_by(open_one, "recording", f"asked for by {ws.source}")
        (sent,) = made
        hearing = asyncio.ensure_future(self._hear(requests, sent))
        try:
            while not (hearing.done() or sent.ended):
                due = asyncio.ensure_future(sent.due.wait())
                ends = asyncio.FIRST_COMPLETED
                await asyncio.wait((hearing, due), timeout=_LOOK, return_when=ends)
                due.cancel()
                sent.due.clear()
                await self._send(ws, sent)
            if hearing.done():
                hearing.result()
        finally:
            hearing.cancel()
            await recordings.end(only=sent)
        await self._send(ws, sent)

    async def _send(self, ws: Wire, sent: SentAway) -> None:
        entries = sent.take()
        for message in await asyncio.to_thread(encode_batch, entries) if entries else ():
            await ws.send(message)

    async def _hear(self, requests: AsyncGenerator[object], sent: SentAway) -> None:
        """Take marks until the program ends the recording."""
        async for request in requests:
            current = self._server.recordings.current
            if isinstance(request, EndRecording):
                return
            if not isinstance(request, Mark):
                raise RemoteProtocolError("message", type(request).__name__, "Mark, EndRecording")
            if current is not None and current.recorder is sent:
                current.mark(request, None, self._server.clock.now())

    def _check(self, request: RecordRequest, ws: Wire) -> None:
        """Raise an error unless the program may record."""
        server = self._server
        admission = server.room_admission.admission
        wall = server.clock.now() + server.clock.to_wall()
        server.limiter.sources.join(ws.source, server.clock.now())
        guest = admission.admit(request.token, server.room_admission.room, wall)
        if guest.grants.may_record or (admission.ring is None and _is_here(ws)):
            return
        advice = "use a token of `cohaptic token --record`, or record on the server's machine"
        raise forbidden("you may not record this room (roomRecord)", advice)


async def _requests(ws: Wire) -> AsyncGenerator[object]:
    while True:
        data = await ws.recv()
        ws.taken()
        if isinstance(data, bytes):
            raise RemoteProtocolError("message", f"{len(data)} bytes", "a text")
        yield decode_request(data)


def _is_here(ws: Wire) -> bool:
    """Whether a program of this machine asks, and no page, and nobody through a proxy by name."""
    headers = {} if ws.request is None else ws.request.headers
    host = urlsplit(f"//{headers.get('Host', '')}").hostname or ""
    if "Origin" in headers:
        return False
    try:
        asked = host == "localhost" or ipaddress.ip_address(host).is_loopback
        return asked and ipaddress.ip_address(ws.source).is_loopback
    except ValueError:
        return False
