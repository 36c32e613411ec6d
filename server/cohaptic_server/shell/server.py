"""The shell: asyncio, websockets, the clock. It moves bytes and decides nothing.

A tick never waits for a peer: frames are written to transports that have room, and the rest waits
in each session's bounded outbox. Those who touch come first; those who watch are served once every
patch of the tick has been written.
"""

from __future__ import annotations

import asyncio
import gc
import logging
from collections.abc import Callable, Iterator

from websockets.asyncio.server import Server, ServerConnection
from websockets.exceptions import ConnectionClosed

from cohaptic.clock import SystemClock
from cohaptic.errors import CloseCode, ProtocolError, RemoteProtocolError, one_line
from cohaptic.protocol.contact_sample import ContactSample
from cohaptic.protocol.messages import Hello, ServerControl, SetLaw, UserLeft, wrong_version
from cohaptic.protocol.patch import Patch
from cohaptic.protocol.version import SUBPROTOCOL
from cohaptic.protocol.watch_messages import Latency, SetLatency, Watch
from cohaptic.runtime.transport import tune
from cohaptic.status.quantiles import Tally
from cohaptic_server.bodies.body import Body
from cohaptic_server.room.latency import Data
from cohaptic_server.room.room import REPLACE_AFTER, Room
from cohaptic_server.room.session import ServerSession
from cohaptic_server.room.watch.audience import Gallery
from cohaptic_server.room.watch.watcher import Watcher
from cohaptic_server.settings import ServerSettings
from cohaptic_server.shell.connection import Connection
from cohaptic_server.shell.http import Web
from cohaptic_server.shell.listener import listen

log = logging.getLogger("cohaptic.server")

CLOSE_TIMEOUT = 1.0  # s for everybody to be told that the server stops
MESH_TIMEOUT = 30.0  # s for the resting mesh to go out
_PIECE = 16 * 1024  # bytes of the resting mesh that are on their way at once


class CohapticServer:
    """One body, its room and its connections.

    Args:
        body: The deformable object.
        settings: Of the server.

    Attributes:
        room: Who touches.
        gallery: Who watches.
        connections: Of both.
        tick_cost: Time that the world's tick and the writing of its patches took [s].
        tick_late: How late each tick began [s].
        watch_cost: Time that those who watch took after a tick [s].
        overruns: Ticks that were left out because the one before took too long.
    """

    def __init__(self, body: Body, settings: ServerSettings) -> None:
        self.settings = settings
        self.clock = SystemClock()
        self.room = Room(body, settings)
        self.web = Web(body, settings, self.clock)
        self.gallery = Gallery(self.room, self.web.model)
        self.tick_cost = Tally()
        self.tick_late = Tally()
        self.watch_cost = Tally()
        self.overruns = 0
        self.connections: set[Connection] = set()
        self._listener: Server | None = None
        self._problem: str | None = None

    async def start(self) -> str:
        """Listen; returns the URL.

        Raises:
            SettingError: The address or port cannot be had.
        """
        # Now: later they would cost those who are here a few ticks.
        if self.room.has_rest_mesh:
            self.room.rest_mesh()
        if self.room.has_touch_mesh:
            self.room.touch_mesh()
        self._listener, url = await listen(self._handle, self.web.process, self.settings)
        return url

    async def run(self, before_tick: Callable[[], None] | None = None) -> None:
        """Tick until cancelled, then tell everybody and close.

        Args:
            before_tick: Called before each tick, in no time: to hand over what was found beside it.
        """
        # What is here now stays: looking through it again and again would cost ticks.
        gc.collect()
        gc.freeze()
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
                if before_tick is not None:
                    before_tick()
                self._tick()
        finally:
            await self._stop()

    def _tick(self) -> None:
        now = self.web.ticked = self.clock.now()
        patches = self.room.tick(now)
        watching: list[Connection] = []
        for connection in list(self.connections):
            session = connection.session
            if isinstance(session, Watcher):
                watching.append(connection)
                continue
            if connection.user in patches:
                self._send_patch(session, patches[connection.user], connection.user)
            session.handle_timer(now)
            connection.flush()
        done = self.clock.now()
        self.tick_cost.add(done - now)
        if watching:
            self.gallery.see(self.room.world, patches, now)
            for connection in watching:
                self._show(connection, done)
            self._report(self.gallery.problem)
            self.watch_cost.add(self.clock.now() - done)

    def _send_patch(self, session: ServerSession, patch: Patch, user: int) -> None:
        """Offer a patch; say once why it is left out, until one is not."""
        had = session.problem
        session.send_patch(patch)
        if session.problem and not had:
            name = self.room.members[user].hello.name
            log.warning("%s gets no patch: %s", name, session.problem)

    def _show(self, connection: Connection, now: float) -> None:
        """Give one who watches the newest scene, if it is due."""
        watcher = connection.session
        assert isinstance(watcher, Watcher)
        was = watcher.slow
        self.gallery.show(watcher, now, clear=connection.clear)
        if watcher.slow and not was:
            log.info("one who watches is slow: its scenes are not acknowledged")
        connection.flush()

    def _report(self, problem: str | None) -> None:
        """Say once why nobody is shown anything."""
        if problem is not None and problem != self._problem:
            log.warning("the scene cannot be shown: %s", problem)
        self._problem = problem

    async def _handle(self, ws: ServerConnection) -> None:
        """One connection, from its first message to its close."""
        tune(ws.transport.get_extra_info("socket"))
        session = ServerSession(self.clock.now())
        connection = Connection(ws, session, self.clock, self._take)
        self.connections.add(connection)
        if ws.subprotocol != SUBPROTOCOL:
            offered = ws.request.headers.get("Sec-WebSocket-Protocol") if ws.request else None
            session.fail(wrong_version(offered or "not named as a subprotocol"))
        reason = ""
        try:
            connection.flush()
            while True:
                connection.receive(await ws.recv())
                if not connection.ready:
                    await self._send_mesh(connection)
        except ConnectionClosed as closed:
            frame = closed.rcvd or closed.sent
            if frame is not None and frame.reason:
                reason = one_line(frame.reason)  # the others read it
        finally:
            self.connections.discard(connection)
            connection.take_rest()
            last = connection.session.close
            self._leave(connection, reason or (last[1] if last else "connection lost"))
            await connection.closed()

    def _take(self, connection: Connection, data: Data) -> None:
        """One message, when it has come."""
        session = connection.session
        session.receive(data, self.clock.now())
        if isinstance(session, Watcher):
            for change in session.events():
                self._set_latency(connection, change)
        else:
            self._react(connection, session)
        connection.flush()

    def _react(self, connection: Connection, session: ServerSession) -> None:
        """Carry what a client said to the room."""
        now = self.clock.now()
        for event in session.events():
            if isinstance(event, Hello):
                self._join(connection, session, event, now)
            elif isinstance(event, Watch):
                self._watch(connection, event)
            elif isinstance(event, ContactSample) and connection.user is not None:
                self.room.sample(connection.user, event, now)
            elif isinstance(event, SetLaw) and connection.user is not None:
                self._set_law(connection, connection.user, event)

    def _join(
        self, connection: Connection, session: ServerSession, hello: Hello, now: float
    ) -> None:
        try:
            welcome, news, replaced = self.room.join(hello, now)
        except ProtocolError as error:
            session.fail(error)
            return
        if replaced is not None:
            limit = f"a sample within {REPLACE_AFTER:g} s: its name was taken over"
            for other in self.connections:
                if other.user == replaced:
                    other.session.fail(ProtocolError("silent user", hello.name, limit))
            gone = UserLeft(user=replaced, name=hello.name, reason="replaced by its return")
            self._tell_others(connection, gone)
        connection.user = welcome.user
        mesh = self.room.touch_mesh() if hello.geometry == "mesh" else None
        welcome = welcome.model_copy(update={"to_wall": self.clock.to_wall()})
        session.accept(welcome, mesh)
        log.info("%s joined with %s", hello.name, hello.law.value)
        self._tell_others(connection, news)

    def _watch(self, connection: Connection, watch: Watch) -> None:
        """A connection watches from now on."""
        watcher = Watcher(watch, has_model=self.web.model is not None)
        connection.session = watcher
        try:
            self.gallery.enter(watcher, self.clock.to_wall())
        except ProtocolError as error:
            watcher.fail(error)
            return
        connection.flush()
        connection.ready = False  # until it has the mesh
        for latency in self._latencies():
            watcher.tell_latency(latency)

    async def _send_mesh(self, connection: Connection) -> None:
        """The resting mesh, then the scene at once. Waits for this peer, and nobody waits for it.

        In fragments: a large mesh must not lie in memory once for each who watches.
        """
        mesh = self.room.rest_mesh()
        pieces = [mesh[at : at + _PIECE] for at in range(0, len(mesh), _PIECE)]
        try:
            async with asyncio.timeout(MESH_TIMEOUT):
                await connection.ws.send(pieces)
        except TimeoutError:
            limit = f"all of it taken within {MESH_TIMEOUT:g} s"
            error = RemoteProtocolError("rest mesh", "not taken", limit, CloseCode.TOO_SLOW)
            connection.session.fail(error)
        connection.ready = True
        self.gallery.see(self.room.world, self.room.patches, self.web.ticked)
        self._show(connection, self.clock.now())

    def _set_law(self, connection: Connection, user: int, change: SetLaw) -> None:
        try:
            self.room.set_law(user, change)
        except ProtocolError as error:
            connection.session.fail(error)

    def _set_latency(self, connection: Connection, change: SetLatency) -> None:
        if not self.settings.allow_latency:
            limit = "none: start the server with --allow-latency to inject latency"
            connection.session.fail(RemoteProtocolError("message", "SetLatency", limit))
            return
        for other in self.connections:
            if other.user == change.user and other.latency != (change.delay, change.jitter):
                other.set_latency(change.delay, change.jitter)
                news = Latency(user=change.user, delay=change.delay, jitter=change.jitter)
                for watcher in self.gallery.watchers:
                    watcher.tell_latency(news)

    def _latencies(self) -> Iterator[Latency]:
        for connection in self.connections:
            delay, jitter = connection.latency
            if connection.user is not None and (delay, jitter) != (0.0, 0.0):
                yield Latency(user=connection.user, delay=delay, jitter=jitter)

    def _leave(self, connection: Connection, reason: str) -> None:
        if isinstance(connection.session, Watcher):
            self.gallery.leave(connection.session)
            log.info("one who watches left: %s", reason)
            return
        if connection.user is None:
            log.info("a client was refused: %s", reason)
            return
        news = self.room.leave(connection.user, reason)
        if news is not None:
            log.info("%s left: %s", news.name, reason)
            self._tell_others(connection, news)

    def _tell_others(self, connection: Connection, news: ServerControl) -> None:
        for other in self.connections:
            if other is not connection and other.session.hears_news:
                other.session.send(news)
                other.flush()

    async def _stop(self) -> None:
        self.web.close()
        for connection in list(self.connections):
            connection.session.stop()
            connection.flush()
        if self._listener is not None:
            self._listener.close()
            try:
                await asyncio.wait_for(self._listener.wait_closed(), CLOSE_TIMEOUT)
            except TimeoutError:
                log.warning("some clients did not answer the close")
