"""The server: connects a session host, which decides, to asyncio, websockets and the clock.

A tick never waits for a peer: frames are written to transports that have room, and the other frames
wait in each session's bounded outbox. Users come first; watchers are served after every patch of
the tick has been written. While nobody is connected and the object is at rest no ticks run, but the
tick numbers go on.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import re
import socket
from collections.abc import Callable, Collection, Mapping
from functools import partial
from typing import cast

from websockets.exceptions import ConnectionClosed
from websockets.protocol import State

from cohaptic.clock import SystemClock, thread_time
from cohaptic.errors import CloseCode, CohapticError, SettingError, one_line
from cohaptic.protocol.version import FAMILY
from cohaptic.room_address import MAIN
from cohaptic.runtime.transport import tune
from cohaptic.sessions.stream import SUBPROTOCOL as RECORD_SUBPROTOCOL
from cohaptic_server.bodies.body import Body
from cohaptic_server.credentials.journal import Journal
from cohaptic_server.process_memory import keep_what_there_is
from cohaptic_server.room.input_record import ColumnRecord
from cohaptic_server.room.latency import Data
from cohaptic_server.room.peer import NOTHING, Outcome, Peer
from cohaptic_server.room.room import Room
from cohaptic_server.room.session_host import MESH_TIMEOUT, SessionHost
from cohaptic_server.room.session_setup import RoomAdmission
from cohaptic_server.room.tick_schedule import (
    MissedTickMonitor,
    TickMeters,
    is_missed,
    next_tick,
    passed_over,
)
from cohaptic_server.room.watch.scene_broadcast import SceneBroadcast
from cohaptic_server.settings import ServerSettings
from cohaptic_server.shell.connection import Connection
from cohaptic_server.shell.endpoint import SETTLING, Endpoint
from cohaptic_server.shell.exchange import OBJECT_CHANGED, Exchange, Solve
from cohaptic_server.shell.http import Web
from cohaptic_server.shell.limiter import ConnectionLimiter, Protection
from cohaptic_server.shell.listener import Listener, listen
from cohaptic_server.shell.recordings import Recordings
from cohaptic_server.shell.refusal import refuse_other_room
from cohaptic_server.shell.remote_recording import RecordingDesk
from cohaptic_server.shell.wire import Wire, last_words

log = logging.getLogger("cohaptic.server")

_TOKEN = re.compile(r"[!#$%&'*+.^_`|~0-9A-Za-z-]{1,60}")
CLOSE_TIMEOUT = 1.0  # s for clients to answer the close when the server stops
NAP = 1.0  # s of sleep at most, since `before_tick` may have work even if nobody connects


class CohapticServer:
    """Server of one body, with its room and its connections.

    Args:
        body: Deformable object that the users touch.
        solve: Finds the block of Green's functions of a vertex, for pages; None lets the body
            itself solve.
        protection: Access control, encryption and trusted proxies; None admits anybody without
            encryption.

    Attributes:
        room: Room with the users who touch the body.
        scene_broadcast: Watchers of the room.
        room_admission: Decides which clients may come into the room.
        session_host: State machine that handles the messages of all peers, users and watchers
            alike.
        limiter: Admits connections, and limits the rates of each address.
        meters: Meters of the ticks since the start, or since other code assigned fresh meters.
        ending: Event that is set when the server begins to stop.
        recordings: Records the session, from the beginning or as an administrator asks.
    """

    def __init__(
        self,
        body: Body,
        settings: ServerSettings,
        solve: Callable[[int], bytes] | None = None,
        protection: Protection | None = None,
    ) -> None:
        self.settings = settings
        self.clock = SystemClock()
        self.room = Room(body, settings)
        self.protection = protection or Protection()
        trusted = self.protection.proxies
        self.limiter = ConnectionLimiter(
            settings.limits, self.clock, settings.simulation_hz, trusted
        )
        self._endpoints: dict[str, Endpoint] = {}
        self.ending = asyncio.Event()
        self.web = Web(body, settings, self.limiter, solve, self._endpoints)
        self.scene_broadcast = SceneBroadcast(self.room, self.web.model)
        state, room = self.protection.state, settings.room or MAIN
        self._journal = None if state is None else Journal(state, room)
        keep = None if self._journal is None else self._journal.keep
        self.room_admission = RoomAdmission(
            self.limiter.sources, self.protection.admission, room, keep
        )
        self.session_host = SessionHost(self.room, self.scene_broadcast, self.room_admission)
        self.recordings = Recordings(self)
        self._endpoints[RECORD_SUBPROTOCOL] = RecordingDesk(self).endpoint
        self.meters = TickMeters()
        self._connections: dict[Peer, Connection] = {}
        self._listener: Listener | None = None
        self._exchange: Exchange | None = None
        self._open = asyncio.Event()  # not set while one object makes way for another
        self._open.set()

    @property
    def connections(self) -> Collection[Connection]:
        """Connections of all peers."""
        return self._connections.values()

    async def start(self, acceptor: socket.socket | None = None) -> str:
        """Start to listen for connections; return the URL of the server.

        Args:
            acceptor: Listening socket to use in place of the port of the settings; None opens the
                port.

        Raises:
            SettingError: The address or port is not available, or the state file cannot be used.
        """
        if self._journal is not None:
            kept = await asyncio.to_thread(self._journal.open)
            self.room_admission.recall(kept, self.clock.now(), self.clock.to_wall())
        self.room.frames.prepare()
        if self.settings.record:
            await self.recordings.begin(self.settings.record)
        self._listener, url = await listen(
            self._handle, self.web.process, self.settings, self.limiter, self.protection.tls,
            acceptor, self._endpoints,
        )  # fmt: skip
        return url

    async def run(self, before_tick: Callable[[ColumnRecord | None], None] | None = None) -> None:
        """Run ticks until cancelled, then send every client the close and stop.

        Args:
            before_tick: Called before each tick, to deliver results that were computed outside the
                tick, with what takes down when columns of the body are asked for and come; None
                where nothing records the session. It has to return quickly.
        """
        keep_what_there_is()
        period = self.settings.simulation_period
        monitor = MissedTickMonitor(period)
        due = self.clock.now()
        try:
            while True:
                if self._exchange is not None:
                    await self._carry_out_exchange(self._exchange)
                    due = self.clock.now()
                due, left_out = next_tick(due, self.clock.now(), period)
                await asyncio.sleep(max(0.0, due - self.clock.now()))
                started = self.clock.now()
                if before_tick is not None:
                    before_tick(self.recordings.columns)
                written = self.tick()
                self._count(monitor, left_out, due, started, written)
                self._show(written)
                self.recordings.after_tick()
                self.limiter.report()
                while self.sleeps:
                    due = await self._nap(due, before_tick)
        finally:
            self.ending.set()
            await self.stop()

    @property
    def sleeps(self) -> bool:
        """Whether ticks can be skipped unnoticed: no connection, no exchange, object at rest."""
        return self._exchange is None and not self.limiter.taken and self.session_host.sleeps

    async def _nap(
        self, due: float, before_tick: Callable[[ColumnRecord | None], None] | None
    ) -> float:
        """Sleep until a client connects, or for `NAP`; return when the newest tick was due [s].

        The ticks that passed during the sleep are counted. A new client finds the room as if it had
        ticked, and the next tick is due at the same time as without the sleep.
        """
        self.limiter.came.clear()
        with contextlib.suppress(TimeoutError):
            await asyncio.wait_for(self.limiter.came.wait(), NAP)
        now = self.web.ticked = self.clock.now()
        self.limiter.tick(now, thread_time())
        due, ticks = passed_over(due, now, self.settings.simulation_period)
        self.session_host.pass_over(ticks, now)
        self.meters.pass_over(ticks)
        if before_tick is not None:
            before_tick(self.recordings.columns)
        self.limiter.report()
        return due

    async def exchange(
        self, build: Callable[[], Body], use: Callable[[Body], Solve | None]
    ) -> None:
        """Serve another body; all clients are disconnected and may connect again.

        Args:
            build: Makes the new body, in a thread, while nobody is in the room.
            use: Called in that thread with the new body when it can be served, before any client
                comes; returns the function that finds Green's functions for pages, None if the body
                itself solves.

        Raises:
            CohapticError: The new body could not be made, or another exchange is running; the old
                body is still served.
        """
        if self._exchange is not None:
            raise CohapticError("another object is being opened; try again in a minute")
        self._exchange = Exchange(build, use, asyncio.get_running_loop().create_future())
        self.limiter.came.set()
        await self._exchange.done

    async def _carry_out_exchange(self, wanted: Exchange) -> None:
        self._open.clear()
        self.limiter.pause()
        await self.recordings.end("the object changes")
        self.carry_out(self.session_host.stop(CloseCode.OBJECT_CHANGED, OBJECT_CHANGED))
        leaving = [connection.closed() for connection in self._connections.values()]
        await asyncio.gather(*leaving, return_exceptions=True)
        try:
            await asyncio.to_thread(self._furnish, wanted)
        except (CohapticError, MemoryError) as error:
            log.warning("the object stays: %s", error)
            wanted.fail(error)
        else:
            # Peers that have not gone yet belong to the old room.
            self._connections = {}
            log.info("the object is %s from now on", self.room.body.name)
            wanted.succeed()
        finally:
            self._exchange = None
            await asyncio.to_thread(keep_what_there_is, anew=True)
            self._open.set()

    def _furnish(self, wanted: Exchange) -> None:
        """Replace the room by one with another body; runs in a thread, while no tick runs."""
        body = wanted.build()
        room = Room(body, self.settings, self.room.next_user)
        room.frames.prepare()
        self.web.serve(body, wanted.use(body))
        room.take_over(self.room)
        self.room = room
        self.scene_broadcast = SceneBroadcast(room, self.web.model)
        self.session_host = SessionHost(room, self.scene_broadcast, self.room_admission)

    def tick(self) -> float:
        """Advance the simulation and write the patches; return the time after the writing [s]."""
        for connection in self._connections.values():
            connection.take_samples()
        now = self.web.ticked = self.clock.now()
        self.limiter.tick(now, thread_time())
        self.session_host.tick(now)
        self.carry_out(self.session_host.serve(now))
        return self.clock.now()

    def _count(
        self, monitor: MissedTickMonitor, left_out: int, due: float, started: float, written: float
    ) -> None:
        period = self.settings.simulation_period
        self.meters.leave_out(left_out)
        self.meters.add(due, started, written, period)
        applied = self.room.world.users.applied
        self.meters.limit(applied.deep, applied.fast)
        if line := monitor.see(1 + left_out, left_out + is_missed(due, written, period)):
            log.warning("%s", line)

    def _show(self, now: float) -> None:
        """Send the newest scene to each watcher that is due to get one."""
        watching = self.session_host.watching
        if not watching:
            return
        self.session_host.update_scene()
        for peer in watching:
            clear = self._connections[peer].clear
            self.carry_out(self.session_host.show(peer, now, clear=clear))
        self.carry_out(self.session_host.report_scene())
        self.meters.watch_cost.add(self.clock.now() - now)

    def carry_out(
        self, outcome: Outcome, connections: Mapping[Peer, Connection] | None = None
    ) -> None:
        """Carry out the tasks of an outcome; `connections` are those of an earlier body's room."""
        connections = self._connections if connections is None else connections
        for line in outcome.log:
            self.limiter.write(line)
        self.recordings.take(outcome)
        for peer in outcome.delayed:
            connections[peer].apply_latency()
        for peer in outcome.flush:
            connections[peer].flush()

    def connect(self, ws: Wire) -> Connection:
        """Make an open websocket a peer of the session host; from now on it receives samples."""
        offered = ws.request.headers.get("Sec-WebSocket-Protocol") if ws.request else None
        peer = self.session_host.connect(self.clock.now(), ws.subprotocol, offered, ws.source)
        take = partial(self._take, self.session_host)
        connection = self._connections[peer] = Connection(ws, peer, self.clock, take)
        ws.deliver, ws.dismiss = connection.receive_frame, connection.fail
        return connection

    def add_endpoint(self, subprotocol: str, endpoint: Endpoint) -> None:
        """Accept a further kind of connections.

        Args:
            subprotocol: Name by which clients request this kind of connection.
            endpoint: Serves the connections of this kind.

        Raises:
            SettingError: The name is no HTTP token, belongs to the protocol of users and watchers,
                or belongs to another endpoint.
        """
        if not _TOKEN.fullmatch(subprotocol):
            raise SettingError("subprotocol", repr(subprotocol[:60]), "a token of HTTP")
        if subprotocol.startswith(FAMILY) or subprotocol in self._endpoints:
            raise SettingError("subprotocol", repr(subprotocol[:60]), "one that nobody has")
        self._endpoints[subprotocol] = endpoint

    async def _serve_endpoint(self, ws: Wire, subprotocol: str) -> None:
        """Serve a connection to an endpoint until it ends, then close it."""
        endpoint = self._endpoints[subprotocol]

        async def serve() -> None:
            await endpoint.serve(ws)

        serving = asyncio.ensure_future(serve())
        closed = asyncio.ensure_future(ws.wait_closed())
        ending = asyncio.ensure_future(self.ending.wait())
        first = asyncio.FIRST_COMPLETED
        try:
            await asyncio.wait((serving, closed), return_when=first)
            if endpoint.leaving is None:
                await asyncio.wait((serving,))
            elif not serving.done():
                await asyncio.wait((serving, ending), timeout=endpoint.leaving, return_when=first)
            if not serving.done():
                await asyncio.wait((serving,), timeout=SETTLING)
        finally:
            for task in (closed, ending, serving):
                task.cancel()
            (error,) = await asyncio.gather(serving, return_exceptions=True)
            if isinstance(error, Exception):
                self._tell_fault(ws, subprotocol, error)
        await ws.close(1011 if isinstance(error, Exception) else 1000)

    def _tell_fault(self, ws: Wire, subprotocol: str, error: Exception) -> None:
        """Log the error of an endpoint, unless the only error is that its client has left."""
        left: BaseException | None = error
        if ws.state is not State.OPEN:
            if isinstance(error, ExceptionGroup):
                left = cast("ExceptionGroup[Exception]", error).split(ConnectionClosed)[1]
            elif isinstance(error, ConnectionClosed):
                left = None
        if left is None:
            return
        sentence = f"{subprotocol} of {ws.source} has failed: {one_line(repr(left), 200)}"
        self.limiter.tell(ws.source, "endpoint_failed", sentence, warning=True)
        log.debug("%s", sentence, exc_info=left)

    async def _handle(self, ws: Wire) -> None:
        """Serve one websocket, from its first message to its close."""
        tune(ws.transport.get_extra_info("socket"))
        if await refuse_other_room(ws, self.settings.room):
            return
        if ws.subprotocol in self._endpoints:
            await self._serve_endpoint(ws, ws.subprotocol)
            return
        await self._open.wait()
        connection = self.connect(ws)
        session_host, connections = self.session_host, self._connections
        peer, reason = connection.peer, ""
        try:
            connection.flush()
            while True:
                connection.receive(await ws.recv())
                if peer.needs_mesh:
                    await self._send_mesh(connection)
                ws.taken()
        except ConnectionClosed as closed:
            peer.farewell, reason = last_words(closed)
        finally:
            ws.deliver = None
            connection.take_rest()
            del connections[peer]
            self.limiter.traffic.end(peer.session.close)
            self.carry_out(session_host.disconnect(peer, reason), connections)
            await connection.closed()

    def _take(
        self, session_host: SessionHost, connection: Connection, data: Data, arrived: float
    ) -> None:
        """Handle one message, at the end of its injected delay."""
        outcome = session_host.receive(connection.peer, data, arrived, self.clock.to_wall())
        if outcome is not NOTHING:
            self.carry_out(outcome)

    async def _send_mesh(self, connection: Connection) -> None:
        """Send the mesh at rest, then the scene; only the handler of this peer waits for them."""
        peer = connection.peer
        taken = await connection.send_whole(self.session_host.begin_mesh(peer), MESH_TIMEOUT)
        now, clear = self.clock.now(), connection.clear
        self.carry_out(self.session_host.finish_mesh(peer, now, taken=taken, clear=clear))

    async def stop(self) -> None:
        """Close all connections and the port; `run` does so when it ends."""
        self.web.close()
        self.carry_out(self.session_host.stop())
        self.limiter.report(after=0.0)
        await self.recordings.close()
        if self._listener is not None:
            self._listener.close()
            try:
                await asyncio.wait_for(self._listener.wait_closed(), CLOSE_TIMEOUT)
            except TimeoutError:
                log.warning("some clients did not answer the close")
        if self._journal is not None:
            await asyncio.to_thread(self._journal.close)
