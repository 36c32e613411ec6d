"""Runs a server with many rooms: its acceptors, the rooms' processes, and the shared seats."""

from __future__ import annotations

import asyncio
import itertools
import logging
import socket
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from ipaddress import ip_address

import cohaptic
from cohaptic.clock import SystemClock
from cohaptic.errors import SettingError
from cohaptic.room_address import below
from cohaptic_ops.cluster.addresses import host_of, host_port, is_here, own_address
from cohaptic_ops.cluster.engine import Engine
from cohaptic_ops.cluster.node import Node, NodeHooks
from cohaptic_ops.cluster.places import Places
from cohaptic_ops.monitoring.admin_port import AdminAddress, AdminPort
from cohaptic_ops.monitoring.lines import RoomLine, ServerLine
from cohaptic_ops.monitoring.metrics import RoomHealth, RoomMetrics, ServerHealth
from cohaptic_ops.rooms.config import RoomsConfig, is_plain_balloon
from cohaptic_ops.rooms.listing import RoomState, room_of
from cohaptic_ops.rooms.process.handing_over import CAN_HAND_OVER
from cohaptic_ops.rooms.process.reports import Allow
from cohaptic_ops.rooms.process.room_process import MACHINE, Build, Protect
from cohaptic_ops.rooms.process.starter import keep_starter, room_processes
from cohaptic_ops.rooms.room_supervisor import House, RoomSupervisor
from cohaptic_ops.rooms.router import BUSY, Place, Router, Site
from cohaptic_ops.rooms.seats import SeatPool
from cohaptic_server.logs import PLAIN, LogStyle
from cohaptic_server.shell.limiter import ConnectionLimiter, Protection
from cohaptic_server.shell.listener import open_acceptors, url_of
from cohaptic_server.shell.refusal import turn_away
from cohaptic_server.side_by_side import processors

log = logging.getLogger("cohaptic.server")

_SHARE_EVERY = 0.25  # s from one sharing of the seats to the next
# The admin port hears of more rooms than `_FEW` only every `_SELDOM`-th time: a word on a thousand
# takes 20 ms.
_FEW, _SELDOM = 100, 4


class RoomsServer:
    """Runs a server with many rooms.

    Args:
        config: Configuration of the server and its rooms.
        builds: Functions that make the bodies, in the processes of the rooms, by name of the room.
        style: Style of the rooms' log.
        protect: Makes the access control of a room, in the room's process.

    Attributes:
        supervisors: Supervisors of the rooms that are on this machine, by name.
        node: This machine in its cluster; None without one.
        users, watchers: Seats of users and of watchers in all rooms together.
        admin: Admin port that gets reports; None without one.
        draining: Whether the server is ending and admits nobody any more.
    """

    def __init__(
        self,
        config: RoomsConfig,
        builds: Mapping[str, Build],
        style: LogStyle = PLAIN,
        protect: Protect = Protection,
    ) -> None:
        if not CAN_HAND_OVER:
            limit = "left out here: this system hands no sockets over; start a server for each room"
            raise SettingError("--config", "given", limit)
        self.config = config
        clock = SystemClock()
        proxies = config.access.trust_proxy
        self.limiter = ConnectionLimiter(config.router.limits, clock, proxies=proxies)
        table = config.admin
        self.admin: AdminPort | None = None
        if table.port is not None:
            self.admin = AdminPort(AdminAddress(table.port, table.host, config.allow_hosts))
        self.draining = False
        make = room_processes(_preload(config, [*builds.values(), protect]))
        self._house = House(
            config.lease, clock, self.limiter.sources.leave, self._changed, make, style, protect,
            None if self.admin is None else self._measured,
        )  # fmt: skip
        self._builds = builds
        self.supervisors: dict[str, RoomSupervisor] = {}
        self.node = self._node() if config.cluster.engine else None
        rooms = config.rooms.items()
        self.users = SeatPool(config.max_users, {name: room.max_users for name, room in rooms})
        self.watchers = SeatPool(
            config.max_watchers, {name: room.max_watchers for name, room in rooms}
        )
        self._begun: set[str] = set()  # rooms with a process that takes part in sharing
        self._names = list(config.rooms)
        inner = ConnectionLimiter(config.router.limits, clock, proxies=proxies)
        self._site = Site(
            config.router,
            inner,
            self._all_states,
            self.limiter.sources.leave,
            listed=config.access.keys is None or config.access.open,
        )
        self._router: Router | None = None
        self._keeping: dict[str, asyncio.Task[None]] = {}
        self._passing: set[asyncio.Task[None]] = set()
        self._beside: list[asyncio.Task[None]] = []

    async def start(self) -> str:
        """Listen, and start the rooms; return the URL when each room is open, broken or idle.

        Raises:
            SettingError: The address or port is not available.
        """
        acceptors = await open_acceptors(self.config.router, self.limiter)
        url = url_of(self.config.host, acceptors[0])
        if self.admin is not None:
            await self.admin.open()
        await self._site.start()
        self._router = Router(acceptors, self.limiter, self._places)
        self._router.open()
        if self.node is not None:
            await self.node.start()
        else:
            for room in self.config.rooms:
                self._host(room)
        self._beside = [
            asyncio.ensure_future(self._keep_sharing()),
            asyncio.ensure_future(keep_starter(self.limiter.clock)),
        ]
        await asyncio.gather(*(supervisor.first.wait() for supervisor in self.supervisors.values()))
        return url

    async def run(self) -> None:
        """Wait until all supervisors have ended; raise the error of one that has failed."""
        if self.node is not None:
            await self.node.run()
        await asyncio.gather(*self._keeping.values())

    def states(self) -> list[RoomState]:
        """Return the state of each room, for the list of rooms."""
        return [self._state(name) for name in self.config.rooms]

    async def drain(self) -> None:
        """Admit nobody any more, tell the rooms to end, and kill rooms that do not end in time."""
        self.draining = True
        self._report()
        if self.node is not None:
            await self.node.leave()
        router, self._router = self._router, None
        if router is not None:
            router.close()
        for supervisor in list(self.supervisors.values()):
            supervisor.stop()
        waiting = [task for task in self._keeping.values() if not task.done()]
        if waiting:
            await asyncio.wait(waiting, timeout=self.config.drain)
        late = [name for name, task in self._keeping.items() if not task.done()]
        if late and waiting:
            log.warning("ended after %g s: %s", self.config.drain, ", ".join(late))
        self.kill()
        if waiting:
            await asyncio.wait(waiting, timeout=self.config.drain)
        for task in (*self._beside, *self._passing):
            task.cancel()
        if self.node is not None:
            await self.node.stop()
        if self.admin is not None:
            await self.admin.close()
        self._site.stop()
        self.limiter.report(after=0.0)

    def read_again(self) -> None:
        """Make all rooms read their key files again, even if the files seem unchanged."""
        for supervisor in self.supervisors.values():
            supervisor.read_again()

    def kill(self) -> None:
        """Kill the processes of all rooms now."""
        for supervisor in self.supervisors.values():
            supervisor.kill()

    def _node(self) -> Node:
        table, rooms = self.config.cluster, self.config.rooms
        always = [name for name, room in rooms.items() if room.idle is None]
        places = Places({name: room.cores for name, room in rooms.items()}, always)
        here = NodeHooks(
            self._host, self._leave, self._owned, self._enter, self._take, self._people,
        )  # fmt: skip
        host = table.host or own_address(table.engine)
        if ip_address(host).is_loopback and not all(is_here(one, host) for one in table.witnesses):
            limit = "an address at which the other machines reach the first one, not a loopback one"
            raise SettingError("--cluster", table.engine, limit)
        witnesses = [host_port(one, table.port) for one in table.witnesses]
        witness = any(is_here(one, host) for one in table.witnesses)
        leads = is_here(host_of(table.engine), host)
        engine = Engine(table.engine, host, MACHINE, leads=leads, watches=witness)
        return Node(
            host_port(host, table.port), tuple(witnesses), witness, table.term, engine, places,
            here, MACHINE, processors(),
        )  # fmt: skip

    def _host(self, room: str) -> None:
        """Run a room on this machine, after its process of before has ended."""
        idle, before = self.config.rooms[room].idle, self._keeping.get(room)
        supervisor = RoomSupervisor(
            self.config.settings_of(room), self._builds[room], self._house, idle
        )
        self.supervisors[room] = supervisor
        if self.node is not None:
            supervisor.start()  # somebody waits for it, at this node or another

        async def keep() -> None:
            if before is not None:
                await asyncio.wait({before})
            try:
                await supervisor.keep()
            finally:
                if self.node is not None and self.supervisors.get(room) is supervisor:
                    del self.supervisors[room]
                    self.node.release(room)

        self._keeping[room] = asyncio.ensure_future(keep())

    def _leave(self, room: str) -> None:
        """End a room on this machine now."""
        supervisor = self.supervisors.pop(room, None)
        if supervisor is not None:
            supervisor.kill()

    def _owned(self, room: str, until: float) -> None:
        supervisor = self.supervisors.get(room)
        if supervisor is not None:
            supervisor.owned(until)

    def _enter(self, source: str) -> bool:
        return self.limiter.admit(source) is None

    def _take(self, connection: socket.socket, room: str, source: str) -> bool:
        supervisor = self.supervisors.get(room)
        taken = supervisor is not None and supervisor.take(connection, source)
        taken = taken or self._site.take(connection, source)  # says why the room takes nobody
        if not taken:
            self.limiter.sources.leave(source)
        return taken

    def _people(self, room: str) -> tuple[int, int]:
        supervisor = self.supervisors.get(room)
        report = supervisor.report if supervisor is not None else None
        return (report.users, report.watchers) if report is not None else (0, 0)

    def _places(self, target: str) -> Sequence[Place]:
        name = room_of(below(target, self.config.base_path), self._names)
        if name is None:
            return (self._site,)
        if self.node is not None and not self.node.owns(name):
            return (_Elsewhere(name, self),)
        return (self.supervisors[name], self._site)

    async def _all_states(self) -> Sequence[RoomState]:
        if self.node is not None:
            await self.node.listed()
        return self.states()

    def _state(self, name: str) -> RoomState:
        table, supervisor = self.config.rooms[name], self.supervisors.get(name)
        there = self.node.found.get(name) if self.node is not None else None
        report = supervisor.report if supervisor is not None else None
        people = report or there
        users = people.users if people is not None else 0
        state = "open" if there is not None else "idle"
        if supervisor is not None:
            state = supervisor.state
        if state == "open" and report is not None and report.users_serial:
            state = "full" if users >= min(table.max_users, report.held_users) else state
        return RoomState(
            name, table.title, state, users, table.max_users,
            people.watchers if people is not None else 0, table.max_watchers,
        )  # fmt: skip

    def pass_on(self, connection: socket.socket, room: str, source: str) -> None:
        """Bring a connection to the node that owns its room, in a task of its own."""
        task = asyncio.ensure_future(self._pass_on(connection, room, source))
        self._passing.add(task)
        task.add_done_callback(self._passing.discard)

    async def _pass_on(self, connection: socket.socket, room: str, source: str) -> None:
        assert self.node is not None
        try:
            if not await self.node.pass_on(connection, room, source):
                turn_away(connection, BUSY, 503)
        finally:
            self.limiter.sources.leave(source)

    def _changed(self, supervisor: RoomSupervisor) -> None:
        """Update the numbers of seats after a room has begun, ended, or reported."""
        name, report = supervisor.name, supervisor.report
        if not supervisor.runs:
            self._begun.discard(name)
        if report is not None:
            self.users.report(name, report.held_users, report.users, report.users_serial)
            self.watchers.report(
                name, report.held_watchers, report.watchers, report.watchers_serial
            )
        elif name not in self._begun:
            self.users.lose(name)
            self.watchers.lose(name)
            if supervisor.runs:
                self._begun.add(name)
                self._share()
        if self.node is not None and supervisor.rests and self.supervisors.get(name) is supervisor:
            supervisor.stop()

    def _measured(self, room: str, metrics: RoomMetrics) -> None:
        if self.admin is not None:
            self.admin.tell(RoomLine(room=room, metrics=metrics))

    def _report(self) -> None:
        """Send the state of the server to the admin port."""
        if self.admin is None:
            return
        rooms = tuple(
            RoomHealth(
                name=k.name, state=k.reported_state, problem=k.problem, restarts=k.restarts.count
            )
            for k in self.supervisors.values()
        )
        sources = self.limiter.sources
        health = ServerHealth(
            version=cohaptic.__version__,
            draining=self.draining,
            rooms=rooms,
            connections=sources.open,
            refused=sources.refused,
            cluster=self.node.health(len(self._passing)) if self.node is not None else None,
        )
        self.admin.tell(ServerLine(health=health))

    def _share(self) -> None:
        changed = {*self.users.share(self._begun), *self.watchers.share(self._begun)}
        for name in changed:
            users, watchers, supervisor = (
                self.users[name],
                self.watchers[name],
                self.supervisors.get(name),
            )
            allow = Allow(
                users=users.wanted,
                watchers=watchers.wanted,
                users_serial=users.serial,
                watchers_serial=watchers.serial,
            )
            if supervisor is not None:
                supervisor.allow(allow)

    async def _keep_sharing(self) -> None:
        for turn in itertools.count():
            self._share()
            self.limiter.report()
            if len(self.supervisors) <= _FEW or turn % _SELDOM == 0:
                self._report()
            await asyncio.sleep(_SHARE_EVERY)


@dataclass(frozen=True, slots=True)
class _Elsewhere:
    """A room that another node owns, or nobody yet.

    Args:
        room: Name of the room.
        rooms_server: RoomsServer of this machine.
    """

    room: str
    rooms_server: RoomsServer

    def take(self, connection: socket.socket, source: str) -> bool:
        """Bring a connection to the node of the room, in a task of its own."""
        try:
            own = connection.dup()
        except OSError:  # no file descriptors are left
            return False
        self.rooms_server.pass_on(own, self.room, source)
        return True


def _preload(config: RoomsConfig, called: Sequence[Callable[..., object]]) -> list[str]:
    """Return the modules for the starter to import, so that rooms need not import them.

    Args:
        called: Functions that rooms call in their processes; their modules are imported.
    """
    functions = [one.func if isinstance(one, partial) else one for one in called]
    modules = dict.fromkeys(str(function.__module__) for function in functions)
    if any(is_plain_balloon(room) for room in config.rooms.values()):
        modules["cohaptic_ops.rooms.process.prebuilt"] = None
    return list(modules)
