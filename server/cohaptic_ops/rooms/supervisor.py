"""Runs a server with many rooms: its doors, the processes of the rooms, and the shared seats.

The rooms share a total number of seats, and each room holds some of them: the supervisor has
assigned these seats to the room. A room may seat as many people as it holds seats, without asking
the supervisor. The sum of the held seats never exceeds the total, even if messages between the
processes are lost or late: if a room has to hold fewer seats, it first reports the smaller number,
and only then another room gets the freed seats.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import cohaptic
from cohaptic.clock import SystemClock
from cohaptic.errors import SettingError
from cohaptic.room_address import below
from cohaptic_ops.monitoring.admin_port import AdminAddress, AdminPort
from cohaptic_ops.monitoring.lines import RoomLine, ServerLine
from cohaptic_ops.monitoring.metrics import RoomHealth, RoomMetrics, ServerHealth
from cohaptic_ops.rooms.config import RoomsConfig, is_plain_balloon
from cohaptic_ops.rooms.directory import LocalDirectory
from cohaptic_ops.rooms.front import Front, Place, Site
from cohaptic_ops.rooms.keeper import House, Keeper
from cohaptic_ops.rooms.listing import RoomState, room_of
from cohaptic_ops.rooms.process.handing_over import CAN_HAND_OVER
from cohaptic_ops.rooms.process.reports import Allow
from cohaptic_ops.rooms.process.room_process import Build, Protect
from cohaptic_ops.rooms.process.starter import keep_starter, room_processes
from cohaptic_server.logs import PLAIN, LogStyle
from cohaptic_server.shell.gate import Gate, Protection
from cohaptic_server.shell.listener import open_doors, url_of


@dataclass(frozen=True, slots=True)
class Seats:
    """Seats that the supervisor has assigned to one room.

    Args:
        most: Largest number of seats that the room can use.
        held: Upper bound of the number of seats that the room holds now.
        wanted: Number of seats that the newest message allows the room to hold.
        used: Number of taken seats in the room's newest report.
        serial: Serial number of the newest message with `wanted` to the room.
    """

    most: int
    held: int = 0
    wanted: int = 0
    used: int = 0
    serial: int = 0


class SeatPool:
    """Divides the seats of a server among its rooms.

    Args:
        total: Number of seats.
        most: Largest number of seats that each room can use, by name of the room.
    """

    def __init__(self, total: int, most: Mapping[str, int]) -> None:
        self.total = total
        self._rooms = {room: Seats(number) for room, number in most.items()}

    def __getitem__(self, room: str) -> Seats:
        return self._rooms[room]

    @property
    def free(self) -> int:
        """Number of seats that no room holds."""
        return self.total - sum(seats.held for seats in self._rooms.values())

    def report(self, room: str, held: int, used: int, serial: int) -> None:
        """Update the known seats of a room from its report.

        Args:
            room: Name of the room.
            held: Number of seats that the room holds; the known number is lowered to it, but never
                raised.
            used: Number of taken seats.
            serial: Serial number of the newest message that the room had read. If a newer message
                is still on its way, the known number of held seats stays.
        """
        seats = self._rooms[room]
        known = min(max(held, 0), seats.held) if serial == seats.serial else seats.held
        self._rooms[room] = replace(seats, held=known, used=max(0, used))

    def lose(self, room: str) -> None:
        """Take all seats back from a room whose process has ended."""
        seats = self._rooms[room]
        self._rooms[room] = Seats(seats.most, serial=seats.serial)

    def share(self, among: Collection[str]) -> dict[str, int]:
        """Divide the seats anew; return the new number of seats of each room where it changes.

        People keep the seats that they have. The rooms that can use more seats share the remaining
        ones equally; if the division leaves a remainder, the rooms with the fewest people get one
        more, so that no room lacks a seat for its first visitor while another has one to spare.

        Args:
            among: Names of the rooms that have a process, without which no room can free its seats.
        """
        by_people = sorted(self._rooms.items(), key=lambda room: room[1].used)
        rooms = {name: seats for name, seats in by_people if name in among}
        spare = self.total - sum(min(s.used, s.most) for s in rooms.values())
        room_left = {name: s.most - min(s.used, s.most) for name, s in rooms.items()}
        targets = _fair(room_left, max(0, spare))
        changed: dict[str, int] = {}
        for name, seats in rooms.items():
            target = min(seats.used, seats.most) + targets[name]
            # A room can only get seats that no other room may still hold.
            given = min(target, seats.held + self.free)
            if given != seats.wanted:
                changed[name] = given
                self._rooms[name] = replace(
                    seats, held=max(seats.held, given), wanted=given, serial=seats.serial + 1
                )
        return changed


def _fair(wants: Mapping[str, int], amount: int) -> dict[str, int]:
    """Divide `amount` equally, but give no name more than its number in `wants`."""
    shares = dict.fromkeys(wants, 0)
    while amount > 0:
        open_ = [name for name in wants if shares[name] < wants[name]]
        if not open_:
            break
        each = max(1, amount // len(open_))
        for name in open_:
            more = min(each, wants[name] - shares[name], amount)
            shares[name] += more
            amount -= more
    return shares


log = logging.getLogger("cohaptic.server")

_SHARE_EVERY = 0.25  # s from one sharing of the seats to the next


class Supervisor:
    """Runs a server with many rooms.

    Args:
        config: Configuration of the server and its rooms.
        builds: Functions that make the bodies, in the processes of the rooms, by name of the room.
        style: Style of the rooms' log.
        protect: Makes the access control of a room, in the room's process.

    Attributes:
        keepers: Keepers of the rooms, by name.
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
        self.gate = Gate(config.front.limits, clock, proxies=proxies)
        table = config.admin
        self.admin: AdminPort | None = None
        if table.port is not None:
            self.admin = AdminPort(AdminAddress(table.port, table.host, config.allow_hosts))
        self.draining = False
        directory = LocalDirectory(config.lease)
        make = room_processes(_preload(config, [*builds.values(), protect]))
        house = House(
            directory, clock, self.gate.sources.leave, self._changed, make, style, protect,
            None if self.admin is None else self._measured,
        )  # fmt: skip
        self.keepers = {
            name: Keeper(config.settings_of(name), builds[name], house, room.idle)
            for name, room in config.rooms.items()
        }
        rooms = config.rooms.items()
        self.users = SeatPool(config.max_users, {name: room.max_users for name, room in rooms})
        self.watchers = SeatPool(
            config.max_watchers, {name: room.max_watchers for name, room in rooms}
        )
        self._begun: set[str] = set()  # rooms with a process that takes part in sharing
        self._names = list(config.rooms)
        inner = Gate(config.front.limits, clock, proxies=proxies)
        self._site = Site(
            config.front,
            inner,
            self.states,
            self.gate.sources.leave,
            listed=config.access.keys is None or config.access.open,
        )
        self._front: Front | None = None
        self._keeping: list[asyncio.Task[None]] = []
        self._beside: list[asyncio.Task[None]] = []

    async def start(self) -> str:
        """Listen, and start the rooms; return the URL when each room is open, broken or idle.

        Raises:
            SettingError: The address or port is not available.
        """
        doors = await open_doors(self.config.front, self.gate)
        url = url_of(self.config.host, doors[0])
        if self.admin is not None:
            await self.admin.open()
        await self._site.start()
        self._front = Front(doors, self.gate, self._places)
        self._front.open()
        self._keeping = [asyncio.ensure_future(keeper.keep()) for keeper in self.keepers.values()]
        self._beside = [
            asyncio.ensure_future(self._keep_sharing()),
            asyncio.ensure_future(keep_starter(self.gate.clock)),
        ]
        await asyncio.gather(*(keeper.first.wait() for keeper in self.keepers.values()))
        return url

    async def run(self) -> None:
        """Wait until all keepers have ended; raise the error of a keeper that has failed."""
        await asyncio.gather(*self._keeping)

    def states(self) -> list[RoomState]:
        """Return the state of each room, for the list of rooms."""
        return [self._state(keeper) for keeper in self.keepers.values()]

    async def drain(self) -> None:
        """Admit nobody any more, tell the rooms to end, and kill rooms that do not end in time."""
        self.draining = True
        self._report()
        front, self._front = self._front, None
        if front is not None:
            front.close()
        for keeper in self.keepers.values():
            keeper.stop()
        waiting = [task for task in self._keeping if not task.done()]
        if waiting:
            await asyncio.wait(waiting, timeout=self.config.drain)
        late = [name for name, keeper in self.keepers.items() if keeper.state != "stopped"]
        if late and waiting:
            log.warning("ended after %g s: %s", self.config.drain, ", ".join(late))
        self.kill()
        if waiting:
            await asyncio.wait(waiting, timeout=self.config.drain)
        for task in self._beside:
            task.cancel()
        if self.admin is not None:
            await self.admin.close()
        self._site.stop()
        self.gate.report(after=0.0)

    def read_again(self) -> None:
        """Make all rooms read their key files again, even if the files seem unchanged."""
        for keeper in self.keepers.values():
            keeper.read_again()

    def kill(self) -> None:
        """Kill the processes of all rooms now."""
        for keeper in self.keepers.values():
            keeper.kill()

    def _places(self, target: str) -> Sequence[Place]:
        name = room_of(below(target, self.config.base_path), self._names)
        return (self._site,) if name is None else (self.keepers[name], self._site)

    def _state(self, keeper: Keeper) -> RoomState:
        table, report = self.config.rooms[keeper.name], keeper.report
        users = report.users if report is not None else 0
        state = keeper.state
        if state == "open" and report is not None and report.users_serial:
            state = "full" if users >= min(table.max_users, report.held_users) else state
        return RoomState(
            keeper.name, table.title, state, users, table.max_users,
            report.watchers if report is not None else 0, table.max_watchers,
        )  # fmt: skip

    def _changed(self, keeper: Keeper) -> None:
        """Update the numbers of seats after a room has begun, ended, or reported."""
        name, report = keeper.name, keeper.report
        if keeper.lease is None:
            self._begun.discard(name)
        if report is not None:
            self.users.report(name, report.held_users, report.users, report.users_serial)
            self.watchers.report(
                name, report.held_watchers, report.watchers, report.watchers_serial
            )
        elif name not in self._begun:
            self.users.lose(name)
            self.watchers.lose(name)
            if keeper.lease is not None:
                self._begun.add(name)
                self._share()

    def _measured(self, room: str, metrics: RoomMetrics) -> None:
        if self.admin is not None:
            self.admin.tell(RoomLine(room=room, metrics=metrics))

    def _report(self) -> None:
        """Send the state of the server to the admin port."""
        if self.admin is None:
            return
        rooms = tuple(
            RoomHealth(
                name=k.name, state=k.told_state, problem=k.problem, restarts=k.restarts.count
            )
            for k in self.keepers.values()
        )
        sources = self.gate.sources
        health = ServerHealth(
            version=cohaptic.__version__,
            draining=self.draining,
            rooms=rooms,
            connections=sources.open,
            refused=sources.refused,
        )
        self.admin.tell(ServerLine(health=health))

    def _share(self) -> None:
        changed = {*self.users.share(self._begun), *self.watchers.share(self._begun)}
        for name in changed:
            users, watchers = self.users[name], self.watchers[name]
            self.keepers[name].allow(
                Allow(
                    users=users.wanted,
                    watchers=watchers.wanted,
                    users_serial=users.serial,
                    watchers_serial=watchers.serial,
                )
            )

    async def _keep_sharing(self) -> None:
        while True:
            with contextlib.suppress(KeyError):
                self._share()
            self.gate.report()
            self._report()
            await asyncio.sleep(_SHARE_EVERY)


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
