"""Protocol session of one client, as a state machine without I/O.

    AWAIT_HELLO --hello--> GREETED --accept--> JOINED --bye, close--> CLOSED
                              |                  |
                              +--queue--> QUEUED-+ (come, then accept; or bye)
      |  |                    |                  |
      |  +---- error, or no hello in time, or refused ----> CLOSED
      +--watch--> WATCHES, continued by another state machine (`watch/watcher.py`)

The lobby passes each message to `receive` and handles the events; the shell writes the messages of
`take`, and closes the connection when `close` is set. A protocol violation raises no exception: the
client gets an error message and a close code, and other clients are not affected.
"""

from __future__ import annotations

from enum import Enum

from cohaptic.errors import CloseCode, LocalProtocolError, ProtocolError, RemoteProtocolError
from cohaptic.protocol.contact_sample import ContactSample
from cohaptic.protocol.control.message import ControlMessage, SetName
from cohaptic.protocol.messages import Bye, Come, Error, Hello, SetLaw, Welcome
from cohaptic.protocol.patch import Patch
from cohaptic.protocol.watch_messages import ClientMessage, Watch, decode_client_message
from cohaptic_server.room.outbox import MAX_EVENTS, Outbox

HELLO_TIMEOUT = 5.0  # s


class State(Enum):
    """State of a client's session; the values complete the sentence "the session ..."."""

    AWAIT_HELLO = "waits for hello"
    GREETED = "waits for the room"
    QUEUED = "waits for a seat"
    JOINED = "joined"
    WATCHES = "watches"
    CLOSED = "closed"


Event = Hello | Watch | Come | SetName | SetLaw | ContactSample | Bye

# Messages that a client may send in each state; all others violate the protocol.
ALLOWED: dict[State, tuple[type[Event], ...]] = {
    State.AWAIT_HELLO: (Hello, Watch),
    State.GREETED: (),
    State.QUEUED: (Come, SetName, Bye),
    State.JOINED: (ContactSample, SetName, SetLaw, Bye),
    State.WATCHES: (),
    State.CLOSED: (),
}


class ServerSession:
    """The server's half of the protocol with one client.

    Args:
        now: Time at which the connection was made [s].

    Attributes:
        state: State of the session.
        close: Code and reason with which the connection is to be closed; None while it stays open.
        outbox: Messages that wait to be sent to the client.
        problem: Reason why the newest patch could not be sent; empty if it was queued.
    """

    def __init__(self, now: float) -> None:
        self.state = State.AWAIT_HELLO
        self.close: tuple[int, str] | None = None
        self._deadline = now + HELLO_TIMEOUT
        self._events: list[Event] = []
        self.outbox = Outbox()
        self.problem = ""
        self._last_seq = 0

    def receive(self, data: str | bytes, now: float) -> None:
        """Handle one message from the client; `events` then returns what the room has to handle."""
        self.handle_timer(now)
        if self.state is State.JOINED and isinstance(data, bytes):
            sample = self.receive_sample(data)
            if sample is not None:
                self._events.append(sample)
            return
        if self.state is State.CLOSED:
            return
        try:
            message = self._decode(data)
        except ProtocolError as error:
            self.fail(error)
            return
        if isinstance(message, Hello):
            self.state = State.GREETED
        elif isinstance(message, Watch):
            self.state = State.WATCHES
        self._events.append(message)
        if isinstance(message, Bye):
            self._end(1000, "bye")

    def receive_sample(self, data: bytes) -> ContactSample | None:
        """Decode a sample of a client that has joined; return None if the session has ended.

        Samples bypass the list of events, since they arrive at the rate of the simulation.
        """
        if self.state is not State.JOINED:
            return None
        try:
            sample = ContactSample.decode(data)
            # A stream keeps order, so a sequence number that does not increase is a client error.
            if sample.seq <= self._last_seq:
                limit = f"more than the last one, {self._last_seq}"
                raise RemoteProtocolError("seq of a contact sample", sample.seq, limit)
        except ProtocolError as error:
            self.fail(error)
            return None
        self._last_seq = sample.seq
        return sample

    def events(self) -> list[Event]:
        """Return the messages for the room that arrived since the last call."""
        events, self._events = self._events, []
        return events

    def queue(self) -> None:
        """Mark the client as waiting for a seat, since the room is full."""
        assert self.state is State.GREETED
        self.state = State.QUEUED

    def accept(self, welcome: Welcome, rest_mesh: bytes | None = None) -> None:
        """Mark the client as joined, and queue the welcome.

        Args:
            rest_mesh: Frame of the touch mesh at rest, for a client with mesh patches; None for
                other clients.
        """
        assert self.state in (State.GREETED, State.QUEUED)
        self.state = State.JOINED
        self.send(welcome)
        if rest_mesh is not None:
            self._check(fits=self.outbox.put_event(rest_mesh))

    def fail(self, error: ProtocolError) -> None:
        """Tell the client the error, and end the session."""
        if self.state is State.CLOSED:
            return
        self.send(Error(code=error.code.value, message=str(error)))
        self._end(error.code.value, str(error))

    def stop(self, code: CloseCode, reason: str) -> None:
        """End the session because the server stops or its object has changed."""
        if self.state is not State.CLOSED:
            self._end(code.value, reason)

    @property
    def hears_news(self) -> bool:
        """Whether the client is told who joins and who leaves."""
        return self.state is State.JOINED

    def take(self, *, clear: bool) -> list[str | bytes]:
        """Remove and return the messages to write now; see `Outbox.take`."""
        return self.outbox.take(clear=clear)

    def send(self, message: ControlMessage) -> None:
        """Queue a message for the client."""
        self._check(fits=self.outbox.put(message))

    def _check(self, *, fits: bool) -> None:
        if not fits:
            reason = f"{MAX_EVENTS} events wait for this client, the limit: it is too slow"
            self._end(CloseCode.TOO_SLOW.value, reason)

    def send_patch(self, patch: Patch) -> None:
        """Queue the newest patch, unless its numbers exceed the range of the wire format.

        Numbers exceed it, for example, when other users push the body out of the coordinate range.
        The user stays in the room, and the client fades its force because no patches arrive.
        """
        if self.state is not State.JOINED:
            return
        try:
            self.outbox.put_patch(patch.encode())
            self.problem = ""
        except LocalProtocolError as error:
            self.problem = str(error)

    def next_deadline(self) -> float | None:
        """Return the time at which `handle_timer` must be called [s]; None without a deadline."""
        return self._deadline if self.state is State.AWAIT_HELLO else None

    def handle_timer(self, now: float) -> None:
        """End the session if no hello has arrived within `HELLO_TIMEOUT`."""
        if self.state is State.AWAIT_HELLO and now >= self._deadline:
            error = RemoteProtocolError(
                "time without a hello",
                f"{HELLO_TIMEOUT:g} s",
                "a hello within it",
                CloseCode.HELLO_TIMEOUT,
            )
            self.fail(error)

    def _decode(self, data: str | bytes) -> Event:
        message: ContactSample | ClientMessage = (
            ContactSample.decode(data) if isinstance(data, bytes) else decode_client_message(data)
        )
        if not isinstance(message, ALLOWED[self.state]):
            allowed = " or ".join(kind.__name__ for kind in ALLOWED[self.state]) or "nothing yet"
            raise RemoteProtocolError(
                "message", type(message).__name__, f"{allowed}: {self.state.value}"
            )
        return message

    def _end(self, code: int, reason: str) -> None:
        self.state = State.CLOSED
        self.close = close_frame(code, reason)


def close_frame(code: int, reason: str) -> tuple[int, str]:
    """Return a close code and its reason, cut to 120 bytes; a close frame allows 123 (RFC 6455)."""
    return code, reason.encode()[:120].decode(errors="ignore")
