"""One connection to a server, from greeting to end: receiving, sending, timing, pacing.

The module also tracks the names of the other users, and puts news of them into words.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

from cohaptic.clock import Clock
from cohaptic.errors import AnotherObject, CloseCode, CohapticError, RemoteProtocolError, one_line
from cohaptic.protocol.contact_sample import ContactSample
from cohaptic.protocol.control.message import Capabilities, LoopRules
from cohaptic.protocol.messages import (
    MAX_MARK_AGE,
    Called,
    Hello,
    Place,
    Recorded,
    Restraints,
    UserJoined,
    UserLeft,
    Welcome,
    encode_control,
)
from cohaptic.protocol.patch import Patch
from cohaptic.protocol.rest_mesh import RestMesh
from cohaptic.protocol.version import PROTOCOL_VERSION
from cohaptic.runtime.direct_loop import DirectLoop
from cohaptic.status.row_batch import Clock as RowClock
from cohaptic.vec import ZERO
from cohaptic_client.devices.catalogue import device_info
from cohaptic_client.devices.kind import DeviceChoice
from cohaptic_client.haptics import Haptics
from cohaptic_client.loop.added import reasons_of
from cohaptic_client.loop.handle import TipSample
from cohaptic_client.network.link import Data, Link
from cohaptic_client.network.marks import PACE, MarksOut
from cohaptic_client.network.server_clock import ClockReading
from cohaptic_client.network.session import ClientSession
from cohaptic_client.network.timing import LinkTiming, Pacer
from cohaptic_client.news import News
from cohaptic_client.settings import ClientSettings


class People:
    """Names of the other users in a room, as the server's messages report them.

    The same message reports a user who joins and a user's new name.

    Args:
        welcome: Welcome message that the server sent to this client.
    """

    def __init__(self, welcome: Welcome) -> None:
        self._names = {user.user: user.name for user in welcome.users}

    @property
    def names(self) -> dict[int, str]:
        """Names of the users, by number."""
        return dict(self._names)

    def news(self, event: UserJoined | UserLeft) -> str:
        """Return a sentence on a user who has joined, left or taken a new name."""
        if isinstance(event, UserLeft):
            self._names.pop(event.user, None)
            return f"{event.name} left" + ("" if event.reason == "bye" else f": {event.reason}")
        before = self._names.get(event.user)
        self._names[event.user] = event.name
        return f"{event.name} joined" if before is None else f"{before} is now called {event.name}"


_LONGEST_REASON = 400  # characters; our own server's are shorter
_WHO = "an administrator of the room"
_BEGINS = (
    f"{_WHO} has frozen the object: it takes nobody's force",
    f"{_WHO} has muted you: the object takes none of your force",
)
_ENDS = ("the object takes forces again", "the object takes your force again")
_FLUSH = 0.1  # s to wait, so that the last message leaves this machine


class Refused(CohapticError):
    """The server refused this client and gave a reason.

    Args:
        code: Number of a `CloseCode`.
        reason: Reason in the server's words.
        field: Field, message or resource at fault; empty where the server names none.
    """

    def __init__(self, code: int, reason: str, field: str = "") -> None:
        super().__init__(code, reason, field)
        self.code = code
        self.reason = reason
        self.field = field

    def __str__(self) -> str:
        return f"the server refused: {one_line(self.reason, _LONGEST_REASON)}"


class Conversation:
    """Exchanges messages between the server and the haptic loop, over one connection.

    Args:
        link: Open connection to the server.
        haptics: Haptic loop of this client. The conversation starts it at the welcome message, or
            for mesh patches at the rest mesh.
        tell: Function that shows a piece of news to the user.
        beat: Function that sends a heartbeat to the loop's process if one is due; it is called
            whenever a sample is due, because a separate timer would wake up the processor for that
            alone.
        key: Secret with which this client can take its own name again after a lost connection.
        token: Token of the invitation, or of the session to resume; empty for none.
        marks: Marks for the recording, which leave beside samples; None for none.

    Attributes:
        active: Whether messages can be sent.
        timing: Round trip and clock offset of this connection.
        session: Token of the session that the server has begun; empty for none.
        place: Position in the queue for a full room, from 1, and the length of the queue; None
            outside a queue.
        server_to_wall: Unix time less the server's clock [s]; 0 before the welcome message.
        patch: Newest patch; None before the first.
        recorded: Whether the server records the session.
    """

    def __init__(
        self,
        link: Link,
        settings: ClientSettings,
        clock: Clock,
        haptics: Haptics,
        tell: Callable[[News], None],
        beat: Callable[[], None],
        key: str | None = None,
        token: str = "",
        marks: MarksOut | None = None,
    ) -> None:
        self.active = False
        self.session = ""
        self.timing = LinkTiming()
        self.server_to_wall = 0.0
        self.place: tuple[int, int] | None = None
        self.patch: Patch | None = None
        self.recorded = False
        self._link = link
        self._settings = settings
        self._clock = clock
        self._haptics = haptics
        self._tell = tell
        self._beat = beat
        self._key, self._token = key, token
        self._marks = MarksOut() if marks is None else marks
        self._session = ClientSession((settings.law,))
        self._welcome: Welcome | None = None
        self._others: People | None = None
        self._restrained = (False, False)  # the object is frozen, this user is muted
        self._pacer: Pacer | None = None
        # A timer needs half of the event loop's work per tick that a sleeping task would need.
        self._timer: asyncio.TimerHandle | None = None
        self._failed: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._seq = 0
        self._rows_dropped = 0

    @property
    def user(self) -> int | None:
        """Number of this user; None before the welcome message."""
        return None if self._welcome is None else self._welcome.user

    @property
    def others(self) -> dict[int, str]:
        """Names of the other users, by number."""
        return {} if self._others is None else self._others.names

    async def run(self) -> str:
        """Greet, receive and send until the connection ends; return the reason why it ended.

        Raises:
            Refused: The server refused this client.
            AnotherObject: The server has an object other than that of the running loop.
            RemoteProtocolError: The server broke the protocol.
        """
        self._link.send(self._session.greeting(greeting(self._settings, self._key, self._token)))
        self.active = True
        listener = asyncio.ensure_future(self._link.receive(self._hear))
        try:
            # An error while a sample is sent ends the conversation.
            ends: set[asyncio.Future[Any]] = {self._failed, listener}
            await asyncio.wait(ends, return_when=asyncio.FIRST_COMPLETED)
            if self._failed.done():
                self._failed.result()
            return await listener
        finally:
            self.active = False
            self._failed.cancel()
            self._stop_sending()
            listener.cancel()

    async def say_goodbye(self) -> None:
        """Send a last sample with zero force, rows and marks that wait, and the farewell.

        The call returns when all have left; each mark takes `PACE`.
        """
        # No scheduled sample may follow the farewell.
        self._stop_sending()
        tip = self._haptics.newest_sample()
        if tip is not None:
            self._send_sample(tip._replace(force=ZERO))
        self._send_rows(whole=True)
        while self.recorded and len(self._marks):
            self._send_marks()
            await asyncio.sleep(PACE)
        self._link.send(self._session.farewell())
        # All messages are still on their way through the injected delay.
        await asyncio.sleep(self._settings.up.longest + _FLUSH)

    def _hear(self, data: Data) -> None:
        """Handle one message from the server, after its injected latency."""
        event = self._session.receive(data)
        if isinstance(event, Patch):
            assert isinstance(data, bytes)
            self._haptics.give_patch(data)
            self.patch = event
            self._learn(event)
        elif isinstance(event, Place):
            self.session = event.session or self.session
            before, self.place = self.place, (event.place, event.of)
            if self.place != before:  # an unchanged position only shows that the server lives
                where = f"place {event.place} of {event.of}"
                sentence = f"the room is full; you wait for a place: {where}"
                self._tell(News("waiting", sentence))
        elif isinstance(event, Called):
            self._tell(News("waiting", "a place is free: it is yours"))
            self._link.send(self._session.coming())
        elif isinstance(event, Welcome):
            self.place = None
            # Rows of the time since the last connection are nobody's: perhaps nothing recorded it.
            self._haptics.record(on=False)
            self._welcome, self._others = event, People(event)
            self.session = event.session or ""
            if self._settings.geometry != "mesh":
                self._begin(event)
        elif isinstance(event, RestMesh):
            self._take_mesh(event)
        elif isinstance(event, UserJoined | UserLeft):
            assert self._others is not None  # the session accepts these only after a welcome
            self._tell(News("user", self._others.news(event)))
        elif isinstance(event, Restraints):
            self._tell_restraints(event)
        elif isinstance(event, Recorded):
            self._tell_recorded(event)
        elif event.code == CloseCode.OBJECT_CHANGED.value:
            raise AnotherObject
        else:
            raise Refused(event.code, event.message, event.field)

    def _tell_restraints(self, new: Restraints) -> None:
        """Tell the user when the object is frozen or this user is muted, and when that ends.

        The muting of other users is not reported.
        """
        was, self._restrained = (
            self._restrained,
            (new.frozen, self._welcome is not None and self._welcome.user in new.muted),
        )
        for before, now, begins, ends in zip(was, self._restrained, _BEGINS, _ENDS, strict=True):
            if before != now:
                self._tell(News("room", begins if now else ends))

    def _tell_recorded(self, new: Recorded) -> None:
        if new.on != self.recorded:
            self.recorded = new.on
            self._haptics.record(on=new.on)
            words = "the server records this session" if new.on else "nothing is recorded any more"
            self._tell(News("recorded", words))

    def _take_mesh(self, mesh: RestMesh) -> None:
        if self._welcome is None or self._settings.geometry != "mesh":
            raise RemoteProtocolError("message", "RestMesh", "none: this client did not ask for it")
        self._haptics.keep_mesh(mesh)
        self._begin(self._welcome)

    def _begin(self, welcome: Welcome) -> None:
        """Start to send samples after the welcome, and start the loop if it does not run yet."""
        others = ", ".join(user.name for user in welcome.users) or "nobody else"
        self._tell(News("touching", f"touching {welcome.body.name} with {others}"))
        self.server_to_wall = welcome.to_wall
        self._haptics.start(welcome)
        self._pacer = Pacer(welcome.simulation_period, self._clock.now())
        self._send_when_due()

    def _learn(self, patch: Patch) -> None:
        """Update the timing estimates and the schedule of samples from a patch."""
        if patch.seq == 0 or self._pacer is None:
            return
        self._pacer = self._pacer.reported(patch.t_client, patch.sample_wait)
        self.timing = self.timing.measured(
            t_client=patch.t_client,
            t_server=patch.t_server,
            sample_wait=patch.sample_wait,
            now=self._clock.now(),
        )

    def _send_when_due(self) -> None:
        """Send the newest sample and a heartbeat if they are due; set the timer for the next."""
        if self._pacer is None:
            return
        now = self._clock.now()
        if self._pacer.due <= now:  # not yet due at a start, or after a report has moved the phase
            self._pacer = self._pacer.sent(now)
            try:
                tip = self._haptics.newest_sample()
                if tip is not None:
                    self._send_sample(tip)
                self._send_rows()
                self._send_marks()
                self._beat()
            except Exception as error:
                self._failed.set_exception(error)
                return
        loop = asyncio.get_running_loop()
        when = loop.time() + max(0.0, self._pacer.due - now)
        if isinstance(loop, DirectLoop):
            loop.set_direct_timer(when, self._send_when_due)
        else:
            self._timer = loop.call_at(when, self._send_when_due)

    def _stop_sending(self) -> None:
        self._pacer = None
        loop = asyncio.get_running_loop()
        if isinstance(loop, DirectLoop):
            loop.cancel_direct_timer()
        elif self._timer is not None:
            self._timer.cancel()

    def _send_sample(self, tip: TipSample) -> None:
        self._seq += 1
        sample = ContactSample(
            self._seq, tip.tick, tip.t, tip.probe, tip.force, tip.anchor, tip.deflection
        )
        self._link.send(sample.encode())

    def _send_rows(self, *, whole: bool = False) -> None:
        """Send rows of the loop behind a sample, if the server records the session."""
        rows = self._haptics.rows_out
        if rows is None or not self.recorded or self.timing.best is None:
            return
        rows.lose(self._link.rows_dropped - self._rows_dropped)
        self._rows_dropped = self._link.rows_dropped
        timing = self.timing
        clock = RowClock(timing.clock_offset, timing.clock_error, timing.round_trip, timing.jitter)
        for frame in rows.batches(clock, whole=whole):
            self._link.send(frame)

    def _send_marks(self) -> None:
        if not self.recorded:
            return
        timing = self.timing
        known = timing.best is not None
        clock = ClockReading(timing.clock_offset, timing.clock_error) if known else None
        mark = self._marks.due(self._clock.now(), clock)
        if mark is None:
            return
        if mark.ago < MAX_MARK_AGE:
            self._link.send(encode_control(mark))
        else:
            self._tell(News("recorded", f"a mark is lost, as the server was: {mark.text}"))


def greeting(settings: ClientSettings, key: str | None = None, token: str = "") -> Hello:
    """Make the first message of a client, with its settings, secret and token."""
    return Hello(
        protocol=PROTOCOL_VERSION,
        name=settings.name,
        law=settings.law,
        max_stiffness=device_info(settings.device).max_stiffness,
        max_force=settings.force_limit,
        damping_budget=settings.damping_limit,
        geometry=settings.geometry,
        friction=settings.friction > 0.0,
        fixed_gains=settings.fixed_gains,
        key=key,
        token=token or None,
        capabilities=capabilities(settings.device),
        wait=settings.wait_seat,
        models=settings.moves_models,
        rules=LoopRules(added=tuple(reasons_of(settings.rules))) if settings.rules else None,
    )


def capabilities(choice: DeviceChoice) -> Capabilities:
    """Return the abilities of a device, in the form that the server gets."""
    info = device_info(choice)
    return Capabilities(
        device=choice.name,
        sensed_axes=info.sensed_axes,
        force_axes=info.force_axes if info.max_force > 0.0 else 0,
        max_force=info.max_force,
        max_stiffness=info.max_stiffness,
        damping=info.damping,
        max_damping=info.max_damping,
        resolution=info.resolution,
        rate=info.rate,
    )
