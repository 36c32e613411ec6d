"""A client: it connects the haptic loop with the server, and reports the state of both."""

from __future__ import annotations

import asyncio
import math
import secrets
from collections.abc import Callable, Mapping
from dataclasses import replace

from cohaptic.clock import SystemClock
from cohaptic.errors import (
    AnotherObject,
    CloseCode,
    CohapticError,
    ServerLost,
    ServerUnreachable,
    SettingError,
    one_line,
)
from cohaptic.protocol.messages import BodyInfo
from cohaptic.protocol.patch import Patch
from cohaptic.recording.journal import Clocks
from cohaptic.status.report import TouchStatus
from cohaptic.status.row import Row
from cohaptic.vec import Vec3
from cohaptic_client.devices.catalogue import device_info
from cohaptic_client.haptics import Haptics
from cohaptic_client.loop.passed import Passed
from cohaptic_client.network.conversation import Conversation, Refused
from cohaptic_client.network.link import Link
from cohaptic_client.network.marks import NOT_RECORDED, MarksOut, Value
from cohaptic_client.network.timing import LinkTiming
from cohaptic_client.news import (
    FaultNews,
    News,
    fault_in_words,
    scheduling_in_words,
    silence_in_words,
)
from cohaptic_client.settings import ClientSettings
from cohaptic_client.touch_state import status_before_touch, touch_status

HEARTBEAT = 0.1  # s between heartbeats while samples are sent
SLOW_HEARTBEAT = 0.5  # s while no samples are sent; the loop ends after 2 s without a heartbeat
_LONGEST_NEWS = 2000  # characters; enough for the names of a full room
RETRY = 0.5  # s between attempts to reach a server


class Client:
    """The client of one user at one server.

    Args:
        tell: Function that shows a piece of news to the user.
        keep: Function that records the new rows of the loop, as blocks for
            `cohaptic.rows_in`; None if the rows of all periods are not needed.
        passed: Device and rules of a script; None if everything has a name.

    Attributes:
        hears: Function that returns whether the user can acknowledge a fault; it returns True
            unless the caller replaces it.
    """

    def __init__(
        self,
        settings: ClientSettings,
        *,
        tell: Callable[[News], None],
        keep: Callable[[bytes], None] | None,
        passed: Passed | None = None,
    ) -> None:
        if passed is not None and passed.choice is not None:
            settings = replace(settings, device=passed.choice)
        self.settings = settings
        self.clock = SystemClock()
        # News contains names and reasons from strangers, and goes to a terminal.
        self._tell: Callable[[News], None] = lambda news: tell(
            News(news.kind, one_line(news, _LONGEST_NEWS))
        )
        pickle = b"" if passed is None else passed.pickle
        self._haptics = Haptics(settings, self.clock, keep, passed=pickle)
        self._target: tuple[Vec3, float] | None = None  # of a scripted tip, in the world frame
        self._lost_before = 0  # rows that never came, of loops for earlier objects
        self._conversation: Conversation | None = None  # the newest one, which may be over
        # Secret with which this client alone can take its name again.
        self._key = secrets.token_hex(16)
        # Session token from the server, which stays valid after the invitation has expired.
        self._session = ""
        self._marks = MarksOut()
        self._next_beat = 0.0
        self._faults = FaultNews()
        self._silences = FaultNews()
        # Late forces do not matter to a hand that is no person's: no news of the scheduling.
        self._scheduling_reported = not device_info(settings.device).held
        # Why the last connection has ended, or none came about.
        self._last_error: CohapticError | None = None
        self._leaving = False  # whether this client ends, so that a lost connection is not reported
        self.hears: Callable[[], bool] = lambda: True

    async def run(self) -> None:
        """Touch until this call is cancelled, the duration is over, or the server is lost for good.

        Raises:
            ServerLost: No server answered within the settings' patience, or their duration.
            Refused: The server refused this client.
            DeviceError: The device cannot be opened, or is gone.
        """
        work = [asyncio.ensure_future(self._keep_beating()), asyncio.ensure_future(self._connect())]
        try:
            done, _ = await asyncio.wait(
                work, timeout=self.settings.duration, return_when=asyncio.FIRST_COMPLETED
            )
            for task in done:
                task.result()
            if not done and self._last_error is not None and self.body is None:
                raise self._last_error
        finally:
            # The connection stays open while the force fades, so that the server hears of it.
            self._leaving = True
            await self._let_go()
            for task in work:
                task.cancel()
            await asyncio.gather(*work, return_exceptions=True)
            self._haptics.close()

    @property
    def body(self) -> BodyInfo | None:
        """Body that this client touches; None before the server has admitted it."""
        return self._haptics.body

    @property
    def row(self) -> Row | None:
        """Row of the loop's newest period; None before the first."""
        return self._haptics.newest_row()

    @property
    def lost_rows(self) -> int:
        """Number of rows that never came to `keep`: this process stood still for seconds."""
        return self._lost_before + self._haptics.lost_rows

    @property
    def patch(self) -> Patch | None:
        """Newest patch, in the world frame; None before the first."""
        return None if self._conversation is None else self._conversation.patch

    @property
    def user(self) -> int | None:
        """Number of this user in the room; None before the server has admitted this client."""
        return None if self._conversation is None else self._conversation.user

    @property
    def token(self) -> str:
        """Token by which this user's further connections are let in; empty for none."""
        conversation = self._conversation
        session = conversation.session if conversation is not None else ""
        return session or self._session or self.settings.token

    @property
    def others(self) -> dict[int, str]:
        """Names of the other users in the room, by number."""
        return {} if self._conversation is None else self._conversation.others

    def move_to(self, point: Vec3, seconds: float = 0.0) -> None:
        """Move a scripted tip to `point` of the world frame [m] in so many seconds [s]."""
        self._target = (point, seconds)
        self._haptics.move_to(point, seconds)

    def status(self) -> TouchStatus:
        """Return the present state of this client."""
        haptics, conversation = self._haptics, self._conversation
        if haptics.row is None:
            place = conversation.place if conversation and conversation.active else None
            return status_before_touch(self.settings.name, place)
        return touch_status(
            self.settings,
            haptics.row,
            haptics.status,
            conversation.timing if conversation else LinkTiming(),
            server_to_wall=conversation.server_to_wall if conversation else 0.0,
            to_wall=self.clock.to_wall(),
            silent_after=haptics.silent_after,
            stopping=haptics.stopping,
        )

    @property
    def timing(self) -> LinkTiming:
        """Timing of the link; that of a new one before the first patch."""
        return LinkTiming() if self._conversation is None else self._conversation.timing

    @property
    def simulation_period(self) -> float:
        """Time between the server's ticks [s]; 0 before the server has admitted this client."""
        return self._haptics.simulation_period

    def clocks(self) -> Clocks:
        """Return how this client's clock stands to the wall clock and to the server's clock."""
        clocks = Clocks(self.clock.now(), self.clock.to_wall())
        conversation = self._conversation
        if conversation is None or conversation.timing.best is None:
            return clocks
        timing = conversation.timing
        return clocks._replace(
            to_server=timing.clock_offset,
            error=timing.clock_error,
            server_to_wall=conversation.server_to_wall,
        )

    def _beat(self) -> None:
        """Send a heartbeat to the loop if one is due, and tell the user new faults and warnings."""
        now = self.clock.now()
        if now < self._next_beat:
            return
        self._next_beat = now + HEARTBEAT
        fault, haptics = self._haptics.beat(), self._haptics
        if self._faults.is_new(fault, now):
            words = fault_in_words(fault, held=haptics.holds_fault, heard=self.hears())
            self._tell(News("fault", words))
        silence = silence_in_words(haptics.status)
        if self._silences.is_new(silence, now):
            self._tell(News("device", silence))
        if not self._scheduling_reported and (reported := haptics.status.get("scheduling", "")):
            self._scheduling_reported = True
            if refused := scheduling_in_words(str(reported)):
                self._tell(News("machine", refused))

    @property
    def recorded(self) -> bool:
        """Whether the server records the session, as far as this client knows."""
        return self._conversation is not None and self._conversation.recorded

    def mark(self, text: str, fields: Mapping[str, Value]) -> None:
        """Set a mark in the recording at this moment; any thread may call this.

        Args:
            text: What it says, up to 200 characters.
            fields: Up to 16 further values.

        Raises:
            SettingError: Nothing records the session, text or fields are out of their limits, or
                too many marks wait.
        """
        if not self.recorded:
            raise SettingError("mark", repr(text[:60]), NOT_RECORDED)
        self._marks.put(self.clock.now(), text, fields)

    def acknowledge(self) -> None:
        """Acknowledge the fault: force may return once the hand has left the object."""
        if self._haptics.holds_fault:
            self._haptics.acknowledge()
            self._tell(News("fault", "acknowledged; lift off the object to go on"))

    async def _keep_beating(self) -> None:
        """Send heartbeats to the loop every `SLOW_HEARTBEAT` [s], even without a connection."""
        while True:
            self._beat()
            await asyncio.sleep(SLOW_HEARTBEAT)

    async def _connect(self) -> None:
        """Connect, and connect again after each loss, within the patience of the settings [s]."""
        patience = self.settings.patience
        until = self.clock.now() + patience
        if self.settings.patience_lost is not None:
            patience = self.settings.patience_lost
        error: CohapticError
        # The error that ended the last session says more than a later "no server answers".
        lost: CohapticError | None = None
        sentence = ""  # last error that the user was told, so that no attempt repeats it
        while True:
            try:
                reason = await self._converse()
                sentence = ""
                until = self.clock.now() + patience
                error = lost = ServerLost(self.settings.url, one_line(reason, _LONGEST_NEWS))
            except ServerUnreachable:
                raise
            except ServerLost as nobody:
                error = nobody
            except AnotherObject as another:
                # Gains that a person has fixed for one object may be unstable at another.
                if self.settings.fixed_gains is not None:
                    raise
                self._tell(News("server", f"{another}; the hand comes back to it"))
                self._lost_before += self._haptics.lost_rows
                self._haptics = await self._haptics.anew()
                if self._target is not None:
                    self._haptics.move_to(*self._target)
                await asyncio.sleep(RETRY)
                until = self.clock.now() + patience
                continue
            except Refused as refused:
                if refused.code == CloseCode.UNAUTHENTICATED.value and self._session:
                    # The session token is another server's, or too old: use the invitation again.
                    self._session = ""
                    continue
                # The server may not know yet that the connection is broken, so the name still looks
                # taken; a server that stops may come back.
                ours = refused.code == CloseCode.NAME_TAKEN.value and self._haptics.running
                if not ours and refused.code != CloseCode.SERVER_STOPS.value:
                    if refused.code == CloseCode.ROOM_FULL.value and not self.settings.wait_seat:
                        self._tell(News("waiting", "with --wait-seat you wait for a place"))
                    raise
                error = refused
            if self._leaving:
                return
            self._last_error = error
            if self.clock.now() >= until:
                raise lost or error
            if str(error) != sentence:
                sentence = str(error)
                left = until - self.clock.now()
                how_long = f" for {left:.0f} s" * (left < math.inf)
                self._tell(News("server", f"{sentence}; trying again{how_long}"))
            await asyncio.sleep(RETRY)

    async def _converse(self) -> str:
        """Open one connection and run it to its end; return the reason why it ended."""
        settings = self.settings
        link = Link(settings.url, self.clock, settings.up, settings.down, settings.ca_file)
        await link.open()
        try:
            # A new conversation for each connection: another server may have another clock.
            self._conversation = Conversation(
                link, settings, self.clock, self._haptics, self._tell, self._beat, self._key,
                self._session or settings.token, self._marks,
            )  # fmt: skip
            return await self._conversation.run()
        finally:
            if self._conversation is not None:
                self._session = self._conversation.session or self._session
            await link.close()

    async def _let_go(self) -> None:
        """Fade the force to zero and end the loop, then say goodbye to the server."""
        if not self._haptics.running:
            return
        await self._haptics.stop()
        if self._conversation is not None and self._conversation.active:
            await self._conversation.say_goodbye()
