"""Protocol session of one client that watches a room, as a state machine without I/O.

    due?  --yes--> a frame is sent, unacknowledged --ack--> drawn
          --two are unacknowledged, or the path is full--> nothing; the next tick asks again

Frames do not queue: if a frame cannot be sent now, a newer frame is sent later in its place. So a
slow page gets fewer frames but no outdated ones, and takes the memory of at most two frames.

News about the other people waits in a mailbox, where newer news replaces older news. A page that
reads slowly gets less news and no outdated news, and the waiting news is bounded.
"""

from __future__ import annotations

from collections import deque

from cohaptic.errors import CloseCode, ProtocolError, RemoteProtocolError
from cohaptic.protocol.ack import Ack
from cohaptic.protocol.control.company import Aim, Follow, Point, Present
from cohaptic.protocol.control.message import ControlMessage
from cohaptic.protocol.messages import Error, Mark, encode_control
from cohaptic.protocol.watch_messages import (
    Latency,
    MeshForm,
    Moderate,
    SetLatency,
    SetView,
    Watch,
    Watching,
    WatchRequest,
    decode_client_message,
)
from cohaptic_server.room.life import Event, State, after, closed_by_server
from cohaptic_server.room.outbox import MAX_EVENTS, Outbox
from cohaptic_server.room.session import close_frame

MAX_POINTED = 16  # people whose newest point waits; the oldest point is dropped first


class Mailbox:
    """News about people that waits for one watcher: encoded messages of `control/company.py`."""

    def __init__(self) -> None:
        self._company: str | None = None
        self._aimed: str | None = None
        self._pointed: dict[object, str] = {}

    def put_company(self, text: str) -> None:
        """Put in the message about the people in the room, in place of an older one."""
        self._company = text

    def put_aimed(self, text: str) -> None:
        """Put in the message with the view of the followed user, in place of an older one."""
        self._aimed = text

    def put_pointed(self, who: object, text: str) -> None:
        """Put in the message with the point that `who` points at, in place of an older one."""
        self._pointed.pop(who, None)
        self._pointed[who] = text
        while len(self._pointed) > MAX_POINTED:
            self._pointed.pop(next(iter(self._pointed)))

    def take(self) -> list[str]:
        """Remove and return the waiting messages, the company first, as the others refer to it."""
        waits = [text for text in (self._company, self._aimed) if text is not None]
        waits += self._pointed.values()
        self._company = self._aimed = None
        self._pointed.clear()
        return waits


IN_FLIGHT = 2  # scenes that may be unacknowledged: one in flight, and one being drawn
SLOW_AFTER = 2.0  # s behind, after which a watcher counts as slow
DROPPED_AFTER = 10.0  # s behind, after which a watcher is disconnected
# s without a scene; a page reports silence after twice this time, so that one scene may be late.
SIGN_OF_LIFE = 0.5
_MAX_LATENCIES = 64  # most users of a room
_REQUESTS: tuple[type[WatchRequest], ...] = (SetView, SetLatency, Moderate, Mark)
_COMPANY: tuple[type[WatchRequest], ...] = (Present, Follow, Aim, Point)


class Watcher:
    """The server's half of the protocol with one watcher.

    Args:
        watch: First message of the watcher.
        has_model: Whether the page can compute the surface from forces; if not, every scene carries
            the surface.

    Attributes:
        state: State of the participant.
        close: Code and reason with which the connection is to be closed; None while it stays open.
        outbox: Messages to be written.
        mesh: Form in which the watcher takes the mesh at rest, such as `quantised`.
        field: As in `ServerSession`.
        slow: Whether the watcher has been behind for `SLOW_AFTER`.
        mailbox: News about the people in the room; None if the watcher did not ask for news.
    """

    def __init__(self, watch: Watch, *, has_model: bool) -> None:
        self.state = State.ASKING
        self.close: tuple[int, str] | None = None
        self.outbox = Outbox()
        self.slow, self.field = False, ""
        self.mesh: MeshForm = watch.mesh
        self.mailbox = Mailbox() if watch.company else None
        self._has_model = has_model
        self._encoding, self._rate = watch.encoding, watch.rate
        self._wants = False
        self._events: list[WatchRequest] = []
        self._latencies: dict[int, Latency] = {}
        self._in_flight: deque[int] = deque()  # ticks
        self._sent_tick = 0
        self._sent_version = 0
        self._sent_surface = False
        self._next = float("-inf")  # when the rate allows another scene [s]
        self._sent_at = float("-inf")  # [s]
        self._behind_since: float | None = None

    def receive(self, data: str | bytes, now: float) -> None:
        """Handle one message from the client; `events` then returns what the room has to handle."""
        del now
        if self.close is not None:
            return
        try:
            if isinstance(data, bytes):
                self._acknowledge(Ack.decode(data))
                return
            message = decode_client_message(data)
            if not isinstance(message, self._allowed):
                *names, last = (kind.__name__ for kind in (Ack, *self._allowed))
                kind, allowed = type(message).__name__, f"{', '.join(names)} or {last}"
                raise RemoteProtocolError("message", kind, f"{allowed}: watches")
        except ProtocolError as error:
            self.fail(error)
            return
        if isinstance(message, SetView):
            self._encoding, self._rate = message.encoding, message.rate
            self._next = float("-inf")
        else:
            self._events.append(message)

    @property
    def _allowed(self) -> tuple[type[WatchRequest], ...]:
        return _REQUESTS if self.mailbox is None else (*_REQUESTS, *_COMPANY)

    def events(self) -> list[WatchRequest]:
        """Return the requests to the server that arrived since the last call."""
        events, self._events = self._events, []
        return events

    def accept(self, watching: Watching) -> None:
        """Queue the first answer to the watcher, which the scene broadcast has accepted."""
        self.state = after(self.state, Event.ADMITTED)
        self.send(watching)

    @property
    def hears_news(self) -> bool:
        """Whether the watcher is told who joins and who leaves."""
        return self.state is State.WATCHING

    @property
    def wants_surface(self) -> bool:
        """Whether the next scene must carry the surface."""
        return self._wants or self._encoding == "frames" or not self._has_model

    def due(self, version: int, now: float, *, clear: bool) -> bool:
        """Whether the newest scene is to be sent now; to be called at every tick.

        Args:
            version: Version of the newest scene.
            now: Time [s].
            clear: Whether the operating system has taken all earlier writes to the watcher.
        """
        if not self.hears_news:
            return False
        full = len(self._in_flight) >= IN_FLIGHT
        if not full and (clear or not self._in_flight):
            self._behind_since, self.slow = None, False
        elif self._behind_since is None:
            self._behind_since = now
        lacks_surface = self.wants_surface and not self._sent_surface
        changed = version > self._sent_version or (version > 0 and lacks_surface)
        return changed and clear and not full and now >= self._next

    def is_left_in_doubt(self, tick: int, version: int, now: float) -> bool:
        """Whether a sign of life is due: nothing changed, and no scene was sent for `SIGN_OF_LIFE`.

        Args:
            tick: Tick of the newest scene.
            version: Version of the newest scene.
            now: Time [s].
        """
        free = self.hears_news and not self._in_flight and version == self._sent_version
        return free and 0 < self._sent_tick < tick and now - self._sent_at >= SIGN_OF_LIFE

    def put_sign_of_life(self, frame: bytes, tick: int, now: float) -> None:
        """Queue the newest scene without surface, for a watcher that has been sent its content."""
        self.outbox.put_patch(frame)
        self._in_flight.append(tick)
        self._sent_tick, self._sent_at = tick, now

    def put_scene(self, frame: bytes, tick: int, version: int, now: float) -> None:
        """Queue the newest scene; its frame has the surface if `wants_surface`."""
        self.outbox.put_patch(frame)
        self._in_flight.append(tick)
        self._sent_tick, self._sent_version, self._sent_at = tick, version, now
        self._sent_surface = self.wants_surface
        # This keeps the mean rate; after a pause, the scene after this one may follow after three
        # quarters of a period instead of a whole period.
        self._next = max(self._next, now - 0.25 / self._rate) + 1.0 / self._rate

    def handle_timer(self, now: float) -> None:
        """Update `slow`, and end the session if the watcher was behind for `DROPPED_AFTER`."""
        if self._behind_since is None or self.close is not None:
            return
        behind = now - self._behind_since
        self.slow = behind >= SLOW_AFTER
        if behind >= DROPPED_AFTER:
            limit = f"acks: {len(self._in_flight)} scenes wait for one"
            waited = f"{DROPPED_AFTER:g} s"
            self.fail(RemoteProtocolError("silence", waited, limit, CloseCode.TOO_SLOW, "ack"))

    def send(self, message: ControlMessage) -> None:
        """Queue a message."""
        if not self.outbox.put(message):
            reason = f"{MAX_EVENTS} events wait for this client, the limit: it is too slow"
            self._end(CloseCode.TOO_SLOW, reason)

    def tell_latency(self, latency: Latency) -> None:
        """Queue a user's latency, in place of an older latency of the same user."""
        self._latencies.pop(latency.user, None)
        self._latencies[latency.user] = latency
        while len(self._latencies) > _MAX_LATENCIES:
            self._latencies.pop(next(iter(self._latencies)))

    def take(self, *, clear: bool) -> list[str | bytes]:
        """Remove and return the messages to write now: events, latencies, mailbox, then a scene."""
        messages = self.outbox.take(clear=clear)
        if clear:
            state = [encode_control(latency) for latency in self._latencies.values()]
            self._latencies.clear()
            state += [] if self.mailbox is None else self.mailbox.take()
            ends_with_scene = bool(messages) and isinstance(messages[-1], bytes)
            at = len(messages) - int(ends_with_scene)
            messages[at:at] = state
        return messages

    def fail(self, error: ProtocolError) -> None:
        """Tell the client the error, and end the session."""
        if self.close is None:
            self.field = error.field
            self.outbox.put(Error.of(error))  # if it does not fit, the close says the same
            self._end(error.code, str(error))

    def stop(self, code: CloseCode, reason: str) -> None:
        """End the session because the server stops or its object has changed."""
        self._end(code, reason)

    def disconnect(self, reason: str, *, farewell: bool) -> None:
        """Note that the connection has ended; as `ServerSession.disconnect`."""
        del farewell
        if self.close is None:
            self.state = after(self.state, Event.LEAVES if reason else Event.LOST)

    def _end(self, code: CloseCode, reason: str) -> None:
        if self.close is None:
            self.state = after(self.state, closed_by_server(code))
            self.close = close_frame(code.value, reason)

    def _acknowledge(self, ack: Ack) -> None:
        if ack.tick > self._sent_tick:
            limit = f"at most that of the newest scene sent, {self._sent_tick}"
            raise RemoteProtocolError("tick of an ack", ack.tick, limit)
        while self._in_flight and self._in_flight[0] <= ack.tick:
            self._in_flight.popleft()
        self._wants = bool(ack.wants)
