"""The process of one room: an ordinary server to which another process hands the connections.

A room may run at a real-time priority, before ordinary processes. Threads of equal real-time
priority do not preempt each other: on two cores, two rooms whose ticks take longer than a period
would stop every other room for good. A room that uses more than `LARGEST` of a core therefore loses
the priority until it uses less than `LESS`.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import signal
import socket
import sys
from collections.abc import Callable
from dataclasses import dataclass, field

from threadpoolctl import threadpool_limits

from cohaptic.clock import SystemClock
from cohaptic.errors import CohapticError, one_line
from cohaptic.runtime.scheduling import (
    SERVER_PRIORITY,
    be_ordinary,
    prefer_this_process,
)
from cohaptic_ops.monitoring.gather import Gatherer
from cohaptic_ops.rooms.process.channel import Channel, open_channel
from cohaptic_ops.rooms.process.handing_over import HandedAcceptor
from cohaptic_ops.rooms.process.reports import (
    NO_SEATS,
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
from cohaptic_server.bodies.body import Body
from cohaptic_server.credentials.reloading import reload_changed
from cohaptic_server.logs import LogStyle, set_up_log
from cohaptic_server.room.input_record import ColumnRecord
from cohaptic_server.settings import ServerSettings
from cohaptic_server.shell.exchange import ServedBody
from cohaptic_server.shell.limiter import Protection
from cohaptic_server.shell.server import CohapticServer

# Fraction of a core above which a room loses its priority, and below which it gets it back
# (hysteresis). If a tick takes at most half of its period, other rooms get their turn in each
# period.
LARGEST = 0.5
LESS = 0.25
CALM = 5.0  # s below `LESS` until a room gets its priority back, so that it does not flap


class Precedence:
    """Decides whether one room may have its real-time priority.

    Attributes:
        first: Whether the room may have real-time priority.
    """

    def __init__(self) -> None:
        self.first = True
        self._calm_since: float | None = None

    def see(self, share: float, now: float) -> bool:
        """Update `first` from the recent cost of a tick; return whether `first` changed.

        Args:
            share: Processor time of a tick divided by the period: the fraction of a core in use.
            now: Time [s].
        """
        before = self.first
        if share > LARGEST:
            self.first, self._calm_since = False, None
        elif share > LESS:
            self._calm_since = None
        elif not self.first:
            if self._calm_since is None:
                self._calm_since = now
            self.first = now - self._calm_since >= CALM
        return self.first != before


REPORT_EVERY = 0.25  # s; an eighth of the shortest lease
# Time between reports of a sleeping room [s]: waking up is the largest cost of such a room. The
# room reports at once when the number of its seats changes.
REPORT_ASLEEP = 0.5
# Time between measurements [s]: the system counts processor time in hundredths of a second, and
# metrics are due every second.
_MEASURED_EVERY = 1.0
_SWITCH_INTERVAL = 5e-4  # s, as in `cohaptic serve`
_NOT_PREPARED = 2  # exit status of a room that could not be opened
log = logging.getLogger("cohaptic.server")

Build = Callable[[ServerSettings], Body]
FOREVER = float("inf")
MACHINE = SystemClock(0.0)  # its time is the same in all processes of the machine
Protect = Callable[[], Protection]


def run_room(
    settings: ServerSettings,
    build: Build,
    control: socket.socket,
    acceptor: socket.socket,
    style: LogStyle,
    protect: Protect = Protection,
    measured: bool = False,
    until: float = FOREVER,
) -> None:
    """Run one room until it has to stop; the main function of its process, never returns.

    Args:
        settings: Settings of the room's server.
        build: Makes the body; a module-level function, which the process can import.
        control: The room's end of the channel to the rooms server.
        acceptor: Receiving end of the pair over which connections are handed over.
        style: Style of the log.
        protect: Makes the access control of the room; reads the key files.
        measured: Whether the room sends its metrics to the rooms server.
        until: Time until which the room may run, on the machine's clock [s]; see `Until`.
    """
    set_up_log(style, settings.room)
    # The rooms server handles both signals: it ends the rooms, or lets them read files again.
    for number in ("SIGINT", "SIGHUP"):
        if hasattr(signal, number):
            signal.signal(getattr(signal, number), signal.SIG_IGN)
    # Several threads of one room would wait for the threads of another room.
    with threadpool_limits(limits=1):
        failed = asyncio.run(
            _Room(settings, build, acceptor, protect, measured, until).live(control)
        )
    logging.shutdown()
    # Exit at once: threads left from the start (a solve, a build) would keep the process alive.
    os._exit(_NOT_PREPARED if failed else 0)


class _NoLeaseError(CohapticError):
    """Error: another node may own the room now."""


@dataclass
class _Room:
    """The room that this process runs, with the arguments of `run_room`."""

    settings: ServerSettings
    build: Build
    acceptor: socket.socket
    protect: Protect = Protection
    measured: bool = False
    until: float = FOREVER
    clock: SystemClock = field(default_factory=SystemClock)
    server: CohapticServer | None = None
    channel: Channel | None = None
    allowed: Allow = NO_SEATS
    stopping: asyncio.Event = field(default_factory=asyncio.Event)
    reading: asyncio.Event = field(default_factory=asyncio.Event)
    news: asyncio.Event = field(default_factory=asyncio.Event)

    async def live(self, control: socket.socket) -> bool:
        """Open the room and serve until it has to stop; return whether it failed."""
        channel = self.channel = await open_channel(control, self._hear, self.stopping.set)
        loop = asyncio.get_running_loop()

        def asked(_number: int, _frame: object) -> None:
            loop.call_soon_threadsafe(self.stopping.set)

        signal.signal(signal.SIGTERM, asked)
        stopping = asyncio.ensure_future(self.stopping.wait())
        work = asyncio.ensure_future(self._serve(channel))
        await asyncio.wait({stopping, work}, return_when=asyncio.FIRST_COMPLETED)
        stopping.cancel()
        work.cancel()
        (outcome,) = await asyncio.gather(work, return_exceptions=True)
        failed = isinstance(outcome, Exception)
        if isinstance(outcome, CohapticError | MemoryError | OSError):
            channel.tell(Failed(why=one_line(str(outcome) or type(outcome).__name__, 2000)))
        elif isinstance(outcome, Exception):
            log.error("the room ends", exc_info=outcome)
            channel.tell(Failed(why=one_line(repr(outcome), 2000)))
        channel.close()
        await asyncio.sleep(0)  # lets the event loop write the last lines
        return failed

    async def _serve(self, channel: Channel) -> None:
        # Built in a thread, so that the room can be stopped meanwhile.
        body = await asyncio.to_thread(self.build, self.settings)
        served = ServedBody(body)
        protection = self.protect()
        again = asyncio.ensure_future(reload_changed(protection.watched, asked=self.reading))
        try:
            await asyncio.to_thread(served.start)
            server = self.server = CohapticServer(body, self.settings, served.solve, protection)
            acceptor = HandedAcceptor(
                self.acceptor, server.limiter, lambda number: channel.tell(Left(numbers=[number]))
            )
            self._allow()
            await server.start(acceptor)
            channel.tell(Ready())
            reporting = asyncio.ensure_future(self._keep_reporting(channel, server))
            sys.setswitchinterval(_SWITCH_INTERVAL)
            prefer_this_process(SERVER_PRIORITY)
            try:
                await server.run(self._before_tick(served.pump))
            finally:
                reporting.cancel()
        finally:
            again.cancel()
            served.stop()

    def _before_tick(
        self, pump: Callable[[ColumnRecord | None], None]
    ) -> Callable[[ColumnRecord | None], None]:
        """Return a function that ends a room before the first tick for which it has no lease.

        A paused room that wakes up may have a successor by then, and its users are there.
        """

        def before(record: ColumnRecord | None) -> None:
            late = MACHINE.now() - self.until
            if late > 0.0:
                raise _NoLeaseError(f"its lease has run out {late:.1f} s ago")
            pump(record)

        return before

    def _hear(self, line: Line) -> None:
        if isinstance(line, Stop):
            self.stopping.set()
        elif isinstance(line, Until):
            self.until = line.at
        elif isinstance(line, ReadAgain):
            self.reading.set()
        elif isinstance(line, Allow):
            self.allowed = line
            self._allow()
            self.news.set()

    def _allow(self) -> None:
        if self.server is not None:
            room = self.server.room
            room.seats.allow(self.allowed.users, room.seated(self.server.clock.now()))
            room.watch_seats.allow(self.allowed.watchers, len(self.server.scene_broadcast.watchers))

    async def _keep_reporting(self, channel: Channel, server: CohapticServer) -> None:
        precedence = Precedence()
        gatherer = Gatherer(server)
        used, done = _processor_time(), _ticks_done(server)
        while True:
            if self.measured:
                channel.tell_newest(Measured(metrics=gatherer.gather()))
            reported = 0.0
            while reported < _MEASURED_EVERY:
                channel.tell_newest(self._report(server))
                reported += await self._pause(server)
            before, used = used, _processor_time()
            done_before, done = done, _ticks_done(server)
            if done <= done_before:
                continue
            # Only ticks that were done count: a room that gets too little processor time would
            # otherwise seem to need little.
            share = (used - before) / (done - done_before) * self.settings.simulation_hz
            if precedence.see(share, self.clock.now()):
                if precedence.first:
                    prefer_this_process(SERVER_PRIORITY)
                else:
                    be_ordinary()
                    log.warning("the room wants %.0f %% of a core: others go first", 100.0 * share)

    async def _pause(self, server: CohapticServer) -> float:
        """Wait until the next report is due; return the upper bound of the wait [s]."""
        if not server.sleeps:
            await asyncio.sleep(REPORT_EVERY)
            return REPORT_EVERY
        self.news.clear()
        with contextlib.suppress(TimeoutError):
            await asyncio.wait_for(self.news.wait(), REPORT_ASLEEP)
        return REPORT_ASLEEP

    def _report(self, server: CohapticServer) -> Report:
        room, meters = server.room, server.meters
        users, watchers = len(room.members), len(server.scene_broadcast.watchers)
        return Report(
            users=users,
            watchers=watchers,
            held_users=room.seats.give_back(room.seated(server.clock.now())),
            held_watchers=room.watch_seats.give_back(watchers),
            users_serial=self.allowed.users_serial,
            watchers_serial=self.allowed.watchers_serial,
            ticks=meters.ticks,
            missed=meters.missed,
        )


def _ticks_done(server: CohapticServer) -> int:
    return server.meters.ticks - server.meters.left_out


def _processor_time() -> float:
    """Return the processor time that this process has used so far [s]."""
    times = os.times()
    return times.user + times.system
