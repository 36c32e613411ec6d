"""Writes to one websocket without waiting, and delays messages if latency is injected."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from cohaptic.clock import Clock
from cohaptic.errors import CloseCode, LinkOverflow, ProtocolError, RemoteProtocolError
from cohaptic.protocol.fields import FrameKind
from cohaptic_server.room.latency import Data, UserLatency
from cohaptic_server.room.peer import Peer
from cohaptic_server.room.session import ServerSession
from cohaptic_server.room.watch.watcher import Watcher
from cohaptic_server.shell.wire import Wire, is_rows, unmask

# Samples, or acks, that wait for a tick; a client sends one or two per tick. If more come, only the
# newest are kept; dropping one costs a tenth of the time that decoding it would.
_MAX_FRAMES = 4
_FRAGMENT = 16 * 1024  # bytes of a long message that are in flight at once


class Connection:
    """The connection of one peer.

    Args:
        ws: Websocket of the connection.
        peer: Peer at the other end; its session holds the messages to it.
        deliver: Called at the end of a message's injected delay, with the connection, the message
            and the time at which the message counts as arrived [s].

    Attributes:
        ready: Whether messages may be written; False while a long message is sent in fragments.
    """

    def __init__(
        self,
        ws: Wire,
        peer: Peer,
        clock: Clock,
        deliver: Callable[[Connection, Data, float], None],
    ) -> None:
        self.ws = ws
        self.peer = peer
        self.ready = True
        self._clock = clock
        self._deliver = deliver
        self._frames: list[tuple[bytes, float]] = []  # samples, with their arrivals [s]
        self._closing: asyncio.Task[None] | None = None
        self._latency: UserLatency | None = None
        self._timer: asyncio.TimerHandle | None = None
        self._running = False

    @property
    def session(self) -> ServerSession | Watcher:
        """Session of the peer."""
        return self.peer.session

    @property
    def user(self) -> int | None:
        """User number of the peer in the room; None if it has not joined, and for a watcher."""
        return self.peer.user

    @property
    def clear(self) -> bool:
        """Whether the operating system has taken all written bytes, and more may be written."""
        ws = self.ws
        return self.ready and not ws.transport.is_closing() and ws.unsent() == 0

    async def send_whole(self, data: bytes, timeout: float) -> bool:
        """Send a long message in fragments; no other message is written meanwhile.

        Because of the fragments, memory does not hold a copy of the message for each peer.

        Args:
            timeout: Time within which the peer has to take the message [s].

        Returns:
            Whether the peer took the message in time.
        """
        fragments = [data[at : at + _FRAGMENT] for at in range(0, len(data), _FRAGMENT)]
        self.ready = False
        try:
            async with asyncio.timeout(timeout):
                await self.ws.send(fragments)
        except TimeoutError:
            return False
        finally:
            self.ready = True
        return True

    def apply_latency(self) -> None:
        """Delay messages in both directions by the peer's injected latency from now on."""
        self.take_samples()
        if self._latency is None:
            self._latency = UserLatency(seed=self.user or 0)
        self._latency.set(self.peer.latency)
        self._run()

    def receive(self, data: Data) -> None:
        """Deliver a message from the peer, now or at the end of its injected delay."""
        self.take_samples()
        if self._latency is None:
            self._deliver(self, data, self._clock.now())
        else:
            self._push(self._latency.push_up, data)

    def receive_frame(self, frame: bytes) -> None:
        """Store the frame of a sample until the next tick, or until another kind of message comes.

        No sample is used before the tick. Decoding all samples at the tick takes a third of the
        time that it takes to decode each sample when the event loop wakes for it.
        """
        if self._latency is not None:
            self.receive(unmask(frame))
            return
        if is_rows(frame):  # which must not take the place of a sample
            self._deliver(self, unmask(frame), self._clock.now())
            return
        if len(self._frames) >= _MAX_FRAMES:
            del self._frames[0]
        self._frames.append((frame, self._clock.now()))

    def take_samples(self) -> None:
        """Deliver the stored samples, each with its time of arrival."""
        if self._frames:
            frames, self._frames = self._frames, []
            for frame, arrived in frames:
                self._deliver(self, unmask(frame), arrived)

    def flush(self) -> None:
        """Write the session's messages without waiting; begin to close an ended session."""
        messages = self.session.take(clear=self.clear)
        if self._latency is None:
            self.ws.write(messages)
        else:
            for data in messages:
                self._delay_or_write(data)
        if self.session.close is not None and self._closing is None:
            self._write_delayed()
            # The close ends `recv` in the handler, which then removes the peer.
            closing = self.ws.close(*self.session.close)
            self._closing = asyncio.get_running_loop().create_task(closing)

    def fail(self, error: ProtocolError) -> None:
        """End the session because of an error, and tell the client the error."""
        self.session.fail(error)
        self.flush()

    def take_rest(self) -> None:
        """Deliver the delayed and stored messages that a peer sent before it disconnected."""
        self.take_samples()
        if self._timer is not None:
            self._timer.cancel()
        if self._latency is not None:
            latency, self._latency = self._latency, None
            for data in latency.due_up(float("inf")):
                self._deliver(self, data, self._clock.now())

    async def closed(self) -> None:
        """Wait until the connection is closed, if it is being closed."""
        if self._closing is not None:
            await self._closing

    def _delay_or_write(self, data: Data) -> None:
        # The injected latency may end between two messages.
        if self._latency is None:
            self.ws.write([data])
        else:
            self._push(self._latency.push_down, data)

    def _push(self, push: Callable[[Data, float], None], data: Data) -> None:
        try:
            push(data, self._clock.now())
        except LinkOverflow as error:
            limit = f"fewer within the injected delay: {error}"
            self.fail(RemoteProtocolError("messages", "too many", limit, CloseCode.TOO_SLOW))
        self._run()

    def _run(self) -> None:
        """Deliver or write the messages whose delay is over, and set a timer for the others."""
        latency = self._latency
        # Delivering a message may queue an answer; the outer call of this function passes it on.
        if latency is None or self._running:
            return
        self._running = True
        now = self._clock.now()
        for data in latency.due_up(now):
            self._deliver(self, data, now)
        for data in latency.due_down(now):
            self._write(data)
        self._running = False
        if latency.gone:
            self._latency = None
            return
        due = latency.next_due()
        if due is not None and self._timer is None:
            wait = max(0.0, due - now)
            self._timer = asyncio.get_running_loop().call_later(wait, self._wake)

    def _wake(self) -> None:
        self._timer = None
        self._run()

    def _write(self, data: Data) -> None:
        is_patch = isinstance(data, bytes) and data[1] == FrameKind.PATCH
        if is_patch and not self.clear:
            return  # a newer patch follows within a tick
        self.ws.write([data])

    def _write_delayed(self) -> None:
        """Write all messages that are still delayed, since they precede the close."""
        if self._latency is not None:
            self.ws.write(self._latency.due_down(float("inf")))
