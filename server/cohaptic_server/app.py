"""The shell: asyncio, websockets, the clock. It moves bytes and decides nothing.

A tick never waits for a peer: frames are written to transports that have room, and the rest waits
in each session's bounded outbox.
"""

from __future__ import annotations

import asyncio
import errno
import logging
import re
from collections.abc import Sequence
from dataclasses import dataclass

from websockets.asyncio.server import Server, ServerConnection, broadcast, serve
from websockets.exceptions import ConnectionClosed
from websockets.typing import Origin, Subprotocol

from cohaptic.clock import SystemClock
from cohaptic.errors import ProtocolError, SettingError, one_line
from cohaptic.protocol.contact_sample import ContactSample
from cohaptic.protocol.control import Hello, ServerControl, SetLaw, UserLeft, wrong_version
from cohaptic.protocol.version import SUBPROTOCOL
from cohaptic.statistics import Tally
from cohaptic.transport import WEBSOCKET_OPTIONS, tune
from cohaptic_server.bodies.body import Body
from cohaptic_server.room import REPLACE_AFTER, Room
from cohaptic_server.session import ServerSession, State
from cohaptic_server.settings import ServerSettings

log = logging.getLogger("cohaptic.server")

MAX_INBOUND_BYTES = 4096  # the largest inbound message is a hello; this is several of them
CLOSE_TIMEOUT = 1.0  # s for everybody to be told that the server stops

# A page from this machine may touch; a page from elsewhere may not use a visitor's browser to.
# None is a native client, which sends no origin.
ORIGINS: Sequence[Origin | re.Pattern[str] | None] = (
    None,
    re.compile(r"https?://(localhost|127\.0\.0\.1|\[::1\])(:\d+)?"),
)


@dataclass(eq=False)
class _Connection:
    ws: ServerConnection
    session: ServerSession
    user: int | None = None
    closing: asyncio.Task[None] | None = None


class CohapticServer:
    """One body, its room and its connections.

    Args:
        body: The deformable object.
        settings: Of the server.

    Attributes:
        tick_cost: Time that the world's tick and the writing of its patches took [s].
        tick_late: How late each tick began [s].
        overruns: Ticks that were left out because the one before took too long.
    """

    def __init__(self, body: Body, settings: ServerSettings) -> None:
        self.settings = settings
        self.room = Room(body, settings)
        self.clock = SystemClock()
        self.tick_cost = Tally()
        self.tick_late = Tally()
        self.overruns = 0
        self._connections: set[_Connection] = set()
        self._listener: Server | None = None

    async def start(self) -> str:
        """Listen; returns the URL.

        Raises:
            SettingError: The address or port cannot be had.
        """
        if self.room.has_rest_mesh:
            self.room.rest_mesh()  # now: later it would cost those who are here a few ticks
        host, port = self.settings.host, self.settings.port
        try:
            self._listener = await serve(
                self._handle,
                host,
                port,
                origins=ORIGINS,
                subprotocols=[Subprotocol(SUBPROTOCOL)],
                # A client without our subprotocol gets a sentence from the session, not a bare 400.
                select_subprotocol=_select_subprotocol,
                server_header=None,
                max_size=MAX_INBOUND_BYTES,
                **WEBSOCKET_OPTIONS,
            )
        except OSError as error:
            if error.errno == errno.EADDRINUSE:
                free = "a free one: stop the other server, or choose with --port"
                raise SettingError("port", f"{port}, which is in use on {host}", free) from error
            raise SettingError(
                "address", f"{host}:{port} ({error})", "one of this machine"
            ) from error
        name = f"[{host}]" if ":" in host else host
        return f"ws://{name}:{next(iter(self._listener.sockets)).getsockname()[1]}"

    async def run(self) -> None:
        """Tick until cancelled, then tell everybody and close."""
        period = self.settings.simulation_period
        due = self.clock.now()
        try:
            while True:
                due += period
                late = self.clock.now() - due
                if late > period:
                    missed = int(late / period)
                    self.overruns += missed
                    due += missed * period
                await asyncio.sleep(max(0.0, due - self.clock.now()))
                self.tick_late.add(max(0.0, self.clock.now() - due))
                self._tick()
        finally:
            await self._stop()

    def _tick(self) -> None:
        now = self.clock.now()
        patches = self.room.tick(now)
        for connection in list(self._connections):
            patch = patches.get(connection.user) if connection.user is not None else None
            if patch is not None:
                connection.session.send_patch(patch)
            connection.session.handle_timer(now)
            self._flush(connection)
        self.tick_cost.add(self.clock.now() - now)

    async def _handle(self, ws: ServerConnection) -> None:
        """One connection, from its first message to its close."""
        sock = ws.transport.get_extra_info("socket")
        tune(sock)
        connection = _Connection(ws, ServerSession(self.clock.now()))
        self._connections.add(connection)
        if ws.subprotocol != SUBPROTOCOL:
            offered = ws.request.headers.get("Sec-WebSocket-Protocol") if ws.request else None
            connection.session.fail(wrong_version(offered or "not named as a subprotocol"))
        reason = "connection lost"
        try:
            self._flush(connection)
            while True:
                connection.session.receive(await ws.recv(), self.clock.now())
                self._react(connection)
                self._flush(connection)
        except ConnectionClosed as closed:
            frame = closed.rcvd or closed.sent
            if frame is not None and frame.reason:
                reason = one_line(frame.reason)  # the others read it
        finally:
            self._connections.discard(connection)
            self._leave(connection, reason)
            if connection.closing is not None:
                await connection.closing

    def _react(self, connection: _Connection) -> None:
        """Carry what a client said to the room."""
        now = self.clock.now()
        for event in connection.session.events():
            if isinstance(event, Hello):
                self._join(connection, event, now)
            elif isinstance(event, ContactSample) and connection.user is not None:
                self.room.sample(connection.user, event, now)
            elif isinstance(event, SetLaw) and connection.user is not None:
                self._set_law(connection, connection.user, event)

    def _join(self, connection: _Connection, hello: Hello, now: float) -> None:
        try:
            welcome, news, replaced = self.room.join(hello, now)
        except ProtocolError as error:
            connection.session.fail(error)
            return
        if replaced is not None:
            limit = f"a sample within {REPLACE_AFTER:g} s: its name was taken over"
            for other in self._connections:
                if other.user == replaced:
                    other.session.fail(ProtocolError("silent user", hello.name, limit))
            gone = UserLeft(user=replaced, name=hello.name, reason="replaced by its return")
            self._tell_others(connection, gone)
        connection.user = welcome.user
        rest_mesh = self.room.rest_mesh() if hello.geometry == "mesh" else None
        welcome = welcome.model_copy(update={"to_wall": self.clock.to_wall()})
        connection.session.accept(welcome, rest_mesh)
        log.info("%s joined with %s", hello.name, hello.law.value)
        self._tell_others(connection, news)

    def _set_law(self, connection: _Connection, user: int, change: SetLaw) -> None:
        try:
            self.room.set_law(user, change)
        except ProtocolError as error:
            connection.session.fail(error)

    def _leave(self, connection: _Connection, reason: str) -> None:
        if connection.user is None:
            log.info("a client was refused: %s", reason)
            return
        news = self.room.leave(connection.user, reason)
        if news is not None:
            log.info("%s left: %s", news.name, reason)
            self._tell_others(connection, news)

    def _tell_others(self, connection: _Connection, news: ServerControl) -> None:
        for other in self._connections:
            if other is not connection and other.session.state is State.JOINED:
                other.session.send(news)
                self._flush(other)

    def _flush(self, connection: _Connection) -> None:
        """Write what may be written, without waiting; begin the close of an ended session."""
        transport = connection.ws.transport
        clear = not transport.is_closing() and transport.get_write_buffer_size() == 0
        for data in connection.session.outbox.take(clear=clear):
            broadcast([connection.ws], data)
        if connection.session.close is not None and connection.closing is None:
            # The close ends `recv` in the handler, which does the rest.
            connection.closing = asyncio.get_running_loop().create_task(
                connection.ws.close(*connection.session.close)
            )

    async def _stop(self) -> None:
        for connection in list(self._connections):
            connection.session.stop()
            self._flush(connection)
        if self._listener is not None:
            self._listener.close()
            try:
                await asyncio.wait_for(self._listener.wait_closed(), CLOSE_TIMEOUT)
            except TimeoutError:
                log.warning("some clients did not answer the close")


def _select_subprotocol(
    _connection: ServerConnection, offered: Sequence[Subprotocol]
) -> Subprotocol | None:
    return Subprotocol(SUBPROTOCOL) if SUBPROTOCOL in offered else None
