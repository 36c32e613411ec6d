"""Keeps the process of one room running: starts and restarts it, and hands connections to it."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import logging
import socket
from collections.abc import Callable
from dataclasses import dataclass, field
from multiprocessing.process import BaseProcess

from cohaptic.clock import Clock
from cohaptic_ops.monitoring.metrics import RoomMetrics
from cohaptic_ops.restarts import Restarts
from cohaptic_ops.rooms.process.channel import Channel, open_channel
from cohaptic_ops.rooms.process.handing_over import hand_over, handing_pair
from cohaptic_ops.rooms.process.reports import (
    Allow,
    Failed,
    Left,
    Line,
    Measured,
    ReadAgain,
    Ready,
    Report,
    Stop,
    Until,
)
from cohaptic_ops.rooms.process.room_process import FOREVER, Build, Protect, run_room
from cohaptic_ops.rooms.process.starter import Hold
from cohaptic_server.logs import PLAIN, LogStyle
from cohaptic_server.settings import ServerSettings
from cohaptic_server.shell.limiter import Protection

log = logging.getLogger("cohaptic.server")

# Time after the start of a room during which new connections may wait for it [s]; clients wait that
# long for an answer.
_WAIT_FOR_START = 3.0
_LOOKS = 8  # checks during the longest silence; the shortest is 2 s
_LONGEST_LOOK = 2.0  # s between checks; an empty room on demand ends at most this much late
# Time by which a check may be late [s]. A later check means that this process was held
# up, and not the room.
_HELD_UP = 1.0


@dataclass(frozen=True, slots=True)
class House:
    """Objects and functions that the supervisors of all rooms share.

    Args:
        silence: Time without a report after which a room's process is ended [s].
        clock: Clock of the rooms server.
        left: Called with the source of each connection that has ended.
        changed: Called with a supervisor whose room has begun, ended or reported.
        make_process: Class of room processes, from `room_processes`.
        style: Style of the rooms' log.
        protect: Makes the access control of a room, in the room's process.
        measured: Called with the name and the metrics of a room; None without an admin port.
    """

    silence: float
    clock: Clock
    left: Callable[[str], None]
    changed: Callable[[RoomSupervisor], None]
    make_process: Callable[..., BaseProcess]
    style: LogStyle = PLAIN
    protect: Protect = Protection
    measured: Callable[[str, RoomMetrics], None] | None = None


@dataclass(frozen=True, slots=True)
class _Handover:
    """Socket pair that hands connections to one process of a room, which may start later.

    Args:
        ours, theirs: Ends of the pair in this process and in the room's process.
        handed: Source of each connection that was handed over and has not ended, by number of the
            connection.
    """

    ours: socket.socket
    theirs: socket.socket
    handed: dict[int, str] = field(default_factory=dict[int, str])


class RoomSupervisor:
    """Keeps the process of one room running, and hands connections to it.

    Args:
        settings: Settings of the room's server.
        build: Makes the body of the room, in the room's process.
        house: Objects and functions that all supervisors share.
        idle: Time after which the process of an empty room ends, to start again on demand [s]; None
            for a room that always runs.

    Attributes:
        name: Name of the room.
        state: State of the room: idle (starts when somebody comes), starting, open, broken (could
            not be opened, and will be tried again) or stopped.
        problem: Reason why the room is broken; empty if it is not.
        report: Newest report of the room's process; None before the first.
        runs: Whether the room has a process, or is about to have one.
        restarts: Number of ends of the room's processes, from which the back-off follows.
        process: Newest process; None before the first.
        first: Event that is set when the room is open, broken or idle for the first time.
    """

    def __init__(
        self, settings: ServerSettings, build: Build, house: House, idle: float | None = None
    ) -> None:
        assert settings.room is not None
        self.name = settings.room
        self.settings = settings
        self.state, self.problem = "starting" if idle is None else "idle", ""
        self.report: Report | None = None
        self.runs = False
        self.restarts = Restarts()
        self.process: BaseProcess | None = None
        self.first = asyncio.Event()
        self._build, self._house, self._idle = build, house, idle
        self._stopping, self._asked = asyncio.Event(), asyncio.Event()
        self._hold: Hold | None = None
        self._channel: Channel | None = None
        self._handover: _Handover | None = None
        self._started = 0.0
        self._ready: float | None = None
        self._heard = 0.0
        self._emptied: float | None = None  # time since which nobody is there [s]
        self._numbers = itertools.count(1)  # of the connections that are handed over
        self._until = FOREVER

    @property
    def reported_state(self) -> str:
        """State for the admin port; a room that starts on demand counts as idle while it starts.

        So the server stays ready meanwhile.
        """
        starts = self.state == "starting" and self._idle is not None
        return "idle" if starts else self.state

    @property
    def rests(self) -> bool:
        """Whether the room has no process and nobody waits for one."""
        waited = self._handover is not None and bool(self._handover.handed)
        return self.state == "idle" and not self.runs and not waited

    def take(self, connection: socket.socket, source: str) -> bool:
        """Hand a connection to the room, and start an idle room; return whether this worked."""
        number, now = next(self._numbers), self._house.clock.now()
        self._emptied = None
        if self.state == "broken":
            self._asked.set()  # without effect for a room that is retried anyway
        if self.state == "idle" and self._handover is None:
            with contextlib.suppress(OSError):  # no file descriptors are left
                self._handover = _Handover(*handing_pair())
        waits = self.state == "starting" and now - self._started < _WAIT_FOR_START
        if self._handover is None or not (waits or self.state in ("idle", "open")):
            return False
        if not hand_over(self._handover.ours, connection, number, source):
            return False
        self._handover.handed[number] = source
        if self.state == "idle":
            self._asked.set()
        return True

    def start(self) -> None:
        """Start an idle room now."""
        self._asked.set()

    def allow(self, allow: Allow) -> None:
        """Send the room the numbers of users and watchers whom it may seat."""
        if self._channel is not None:
            self._channel.tell(allow)

    def read_again(self) -> None:
        """Make a running room read its key files again; a room that starts reads them anyway."""
        if self._channel is not None:
            self._channel.tell(ReadAgain())

    def owned(self, until: float) -> None:
        """Let the room run until a time on the machine's clock, if it is leased [s]."""
        self._until = until
        if self._channel is not None:
            self._channel.tell(Until(at=until))

    async def keep(self) -> None:
        """Run the room, one process after another, until `stop` is called."""
        while not self._stopping.is_set():
            if self.state == "idle":
                self.first.set()
                await self._asked.wait()
                if self._stopping.is_set():
                    break
            self._ready = self._emptied = None
            await self._live()
            if self.state == "idle":
                continue
            now = self._house.clock.now()
            self.restarts = self.restarts.ended(self._ready, now)
            if self._stopping.is_set():
                break
            pause = self.restarts.pause
            sentence = f", {self.problem}" if self.problem else ""
            log.warning(
                "room %s has ended%s; it is started again%s",
                self.name, sentence, f" in {pause:g} s" if pause else "",
                extra=self._report("room_ended"),
            )  # fmt: skip
            await self._pause(pause or 1e-3)
            if self._idle is not None and self.problem:
                # Nobody waits in a broken room: the next connection triggers another try.
                self._asked.clear()
                if not self._stopping.is_set():
                    await self._asked.wait()
        self._shut(self._handover)
        self.state = "stopped"
        self.first.set()

    def stop(self) -> None:
        """Tell the room to close its clients' connections and to end; `keep` then returns."""
        self._end_keeping()
        if self._channel is not None:
            self._channel.tell(Stop())

    def kill(self) -> None:
        """Kill the room's process now; `keep` then returns."""
        self._end_keeping()
        if self._hold is not None:
            self._hold.kill()

    async def _pause(self, seconds: float) -> None:
        with contextlib.suppress(TimeoutError):
            await asyncio.wait_for(self._stopping.wait(), seconds)

    def _end_keeping(self) -> None:
        self._stopping.set()
        self._asked.set()

    async def _live(self) -> None:
        """Run one process of the room, from its start to its end."""
        house = self._house
        # A broken room stays broken until it is open again.
        self.state = "broken" if self.problem else "starting"
        self._started = self._heard = house.clock.now()
        self.runs = True
        self._asked.clear()
        try:
            handover = self._handover = self._handover or _Handover(*handing_pair())
            control, their_control = socket.socketpair()
        except OSError as error:
            self.problem = f"its process cannot be started: {error.strerror}"
            await self._end(self._handover)
            return
        gone = asyncio.Event()
        try:
            self.process = house.make_process(
                target=run_room,
                args=(
                    self.settings,
                    self._build,
                    their_control,
                    handover.theirs,
                    house.style,
                    house.protect,
                    house.measured is not None,
                    self._until,
                ),
                name=f"room {self.name}",
            )
            # Not daemonic, since the room has a child process for columns.
            await asyncio.to_thread(self.process.start)
            self._hold = Hold(self.process)
            their_control.close()
            handover.theirs.close()
            self._channel = await open_channel(control, self._hear, gone.set)
            house.changed(self)
            if self._stopping.is_set():
                self._channel.tell(Stop())
            await self._watch(gone)
        except OSError as error:
            self.problem = f"its process cannot be started: {error.strerror}"
        except EOFError:  # the starter has ended before it forked the room
            log.warning(
                "room %s was not started", self.name, extra=self._report("room_not_started")
            )
        finally:
            if self._channel is None:
                control.close()
            their_control.close()
            await self._end(handover)

    async def _watch(self, gone: asyncio.Event) -> None:
        """Wait until the process has ended, or has been silent for too long.

        The method also tells the process to end when the room has been empty for its idle time.
        """
        house = self._house
        look_every = min(_LONGEST_LOOK, house.silence / _LOOKS)
        while not gone.is_set():
            before = house.clock.now()
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(gone.wait(), look_every)
            now = house.clock.now()
            if now - before > look_every + _HELD_UP:
                self._heard = now  # this process was held up, not the room
            elif self._ready is None:
                self._heard = now  # opening a room may take minutes
            silent = now - self._heard
            if silent >= house.silence:
                reported = self._report("room_silent")
                log.warning("room %s says nothing for %.1f s", self.name, silent, extra=reported)
                return
            if self._is_to_rest(now) and self._channel is not None:
                log.info("room %s is idle; it starts when somebody comes", self.name,
                         extra=self._report("room_idle"))  # fmt: skip
                # New connections now wait for the next process; `_end` closes the old handover.
                self._handover, self.state = None, "idle"
                self._channel.tell(Stop())

    def _is_to_rest(self, now: float) -> bool:
        """Whether the room has been empty for its idle time, so that its process has to end."""
        report, handover = self.report, self._handover
        if (
            self._idle is None
            or self.state != "open"
            or (report is None or report.users or report.watchers)
            or (handover is None or handover.handed)
        ):
            self._emptied = None
            return False
        self._emptied = now if self._emptied is None else self._emptied
        return now - self._emptied >= self._idle

    async def _end(self, handover: _Handover | None) -> None:
        """Kill the process, and close its channel and handover."""
        house, hold = self._house, self._hold
        self._hold = None
        if hold is not None:
            hold.kill()
            await asyncio.to_thread(hold.join)
        if self._channel is not None:
            self._channel.abort()
        self._channel = self.report = None
        if self.state != "idle":
            self.state = "broken" if self.problem else "starting"
        self._shut(handover)
        self.runs = False
        house.changed(self)

    def _shut(self, handover: _Handover | None) -> None:
        """Close a handover, and count all its connections as ended."""
        if handover is None:
            return
        handover.ours.close()
        handover.theirs.close()
        for source in handover.handed.values():
            self._house.left(source)
        if self._handover is handover:
            self._handover = None

    def _report(self, event: str) -> dict[str, str]:
        return {"event": event, "room": self.name}

    def _hear(self, line: Line) -> None:
        house = self._house
        match line:
            case Left():
                handed = self._handover.handed if self._handover is not None else {}
                for number in line.numbers:
                    source = handed.pop(number, None)
                    if source is not None:
                        house.left(source)
            case Ready():
                self.state, self.problem = "open", ""
                self._ready = self._heard = house.clock.now()
                took = self._ready - self._started
                pid = self.process.pid if self.process is not None else None
                words, reported = (
                    "room %s is open, process %s, after %.1f s",
                    self._report("room_open"),
                )
                log.info(words, self.name, pid, took, extra=reported)
                self.first.set()
                house.changed(self)
            case Report():
                self._heard = house.clock.now()
                self.report = line
                house.changed(self)
            case Measured():
                if house.measured is not None:
                    house.measured(self.name, line.metrics)
            case Failed():
                self.state, self.problem = "broken", line.why
                self.first.set()
                house.changed(self)
            case _:
                pass
