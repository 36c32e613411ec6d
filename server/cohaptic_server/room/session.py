"""Protocol session of one client, as a state machine without I/O; `life.py` has its states.

The session host passes each message to `receive` and handles the events; the shell writes the
messages of `take`, and closes the connection when `close` is set. A protocol violation raises no
exception: the client gets an error message and a close code, and other clients are not affected. A
client that watches goes on with another state machine (`watch/watcher.py`).
"""

from __future__ import annotations

from cohaptic.errors import CloseCode, LocalProtocolError, ProtocolError, RemoteProtocolError
from cohaptic.protocol.contact_sample import ContactSample
from cohaptic.protocol.control.message import ControlMessage
from cohaptic.protocol.messages import Bye, Called, Come, Error, Hello, Welcome
from cohaptic.protocol.patch import Patch
from cohaptic.protocol.watch_messages import ClientMessage, Watch, decode_client_message
from cohaptic.status.row_batch import RowBatch
from cohaptic_server.room.life import (
    HELLO_TIMEOUT,
    MESSAGES,
    Event,
    Message,
    State,
    after,
    closed_by_server,
)
from cohaptic_server.room.outbox import MAX_EVENTS, Outbox


class ServerSession:
    """The server's half of the protocol with one client.

    Args:
        now: Time at which the connection was made [s].

    Attributes:
        state: State of the participant.
        close: Code and reason with which the connection is to be closed; None while it stays open.
        outbox: Messages that wait to be sent to the client.
        field: Field at fault of a client that was refused (`ProtocolError.field`); empty otherwise.
        problem: Reason why the newest patch could not be sent; empty if it was queued.
    """

    def __init__(self, now: float) -> None:
        self.state = State.OFFERED
        self.close: tuple[int, str] | None = None
        self._deadline = now + HELLO_TIMEOUT
        self._events: list[Message] = []
        self.outbox = Outbox()
        self.problem = self.field = ""
        self._last_seq = 0

    def receive(self, data: str | bytes, now: float) -> None:
        """Handle one message from the client; `events` then returns what the room has to handle."""
        self.handle_timer(now)
        if self.state is State.JOINED and isinstance(data, bytes):
            sample = self.receive_sample(data)
            if sample is not None:
                self._events.append(sample)
            return
        if self.close is not None:
            return
        try:
            message = self._decode(data)
        except ProtocolError as error:
            self.fail(error)
            return
        if isinstance(message, Hello | Watch):
            self._move(Event.ASKS)
        elif isinstance(message, Come):
            self._move(Event.COMES)
        self._events.append(message)
        if isinstance(message, Bye):
            self._end(Event.LEAVES, 1000, "bye")

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

    def receive_rows(self, data: bytes) -> RowBatch | None:
        """Decode rows of a client that has joined; return None if the session has ended."""
        if self.state is not State.JOINED:
            return None
        try:
            return RowBatch.decode(data)
        except ProtocolError as error:
            self.fail(error)
            return None

    def events(self) -> list[Message]:
        """Return the messages for the room that arrived since the last call."""
        events, self._events = self._events, []
        return events

    def queue(self) -> None:
        """Let the client wait for a seat, since the room is full."""
        self._move(Event.QUEUED)

    def call(self, called: Called) -> None:
        """Call the client to a seat."""
        self._move(Event.CALLED)
        self.send(called)

    def accept(self, welcome: Welcome, rest_mesh: bytes | None = None) -> None:
        """Mark the client as joined, and queue the welcome.

        Args:
            rest_mesh: Frame of the touch mesh at rest, for a client with mesh patches; None for
                other clients.
        """
        self._move(Event.SEATED)
        self.send(welcome)
        if rest_mesh is not None:
            self._check(fits=self.outbox.put_event(rest_mesh))

    def fail(self, error: ProtocolError, event: Event | None = None) -> None:
        """Tell the client the error, and end the session.

        Args:
            event: What the end is for the participant; None for what the close code says.
        """
        if self.close is None:
            self.field = error.field
            self.outbox.put(Error.of(error))  # if it does not fit, the close says the same
            self._end(event or closed_by_server(error.code), error.code.value, str(error))

    def stop(self, code: CloseCode, reason: str) -> None:
        """End the session because the server stops or its object has changed."""
        if self.close is None:
            self._end(closed_by_server(code), code.value, reason)

    def disconnect(self, reason: str, *, farewell: bool) -> None:
        """Note that the connection has ended.

        Args:
            reason: Reason that the client gave for closing, or its error; empty without a reason.
            farewell: Whether the client itself has closed the connection properly.
        """
        if self.close is None:
            self._move(Event.LEAVES if reason else Event.LOST)
        elif self.state is State.KEPT and farewell:
            self._move(Event.LEAVES)

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
            self._end(Event.LOST, CloseCode.TOO_SLOW.value, reason)

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
        return self._deadline if self.state is State.OFFERED else None

    def handle_timer(self, now: float) -> None:
        """End the session if no hello has arrived within `HELLO_TIMEOUT`."""
        if self.state is State.OFFERED and now >= self._deadline:
            error = RemoteProtocolError(
                "time without a hello",
                f"{HELLO_TIMEOUT:g} s",
                "a hello within it",
                CloseCode.HELLO_TIMEOUT,
                "hello",
            )
            self.fail(error, Event.SILENT)

    def _decode(self, data: str | bytes) -> Message:
        message: ContactSample | ClientMessage = (
            ContactSample.decode(data) if isinstance(data, bytes) else decode_client_message(data)
        )
        kinds = MESSAGES.get(self.state, ())
        if not isinstance(message, kinds):
            allowed = " or ".join(kind.__name__ for kind in kinds) or "nothing yet"
            raise RemoteProtocolError(
                "message", type(message).__name__, f"{allowed}: {self.state.value}"
            )
        return message

    def _move(self, event: Event) -> None:
        self.state = after(self.state, event)

    def _end(self, event: Event, code: int, reason: str) -> None:
        if self.close is None:
            self._move(event)
            self.close = close_frame(code, reason)


def close_frame(code: int, reason: str) -> tuple[int, str]:
    """Return a close code and its reason, cut to 120 bytes; a close frame allows 123 (RFC 6455)."""
    return code, reason.encode()[:120].decode(errors="ignore")
