"""One websocket: writes without waiting, and holds messages back where latency is injected."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from websockets.asyncio.server import ServerConnection, broadcast

from cohaptic.clock import Clock
from cohaptic.errors import CloseCode, LinkOverflow, ProtocolError, RemoteProtocolError
from cohaptic.protocol.frame import FrameKind
from cohaptic_server.room.latency import Data, UserLatency
from cohaptic_server.room.session import ServerSession
from cohaptic_server.room.watch.watcher import Watcher


class Connection:
    """The shell round one session.

    Args:
        ws: The websocket.
        session: What is said on it; a watcher takes over from the session that it began as.
        clock: Of the server.
        deliver: Called with each message that has come, delay included.

    Attributes:
        user: Number in the room; None before it has joined, and for one who watches.
        ready: Whether it may be written to; not while the resting mesh goes out in fragments.
    """

    def __init__(
        self,
        ws: ServerConnection,
        session: ServerSession | Watcher,
        clock: Clock,
        deliver: Callable[[Connection, Data], None],
    ) -> None:
        self.ws = ws
        self.session = session
        self.user: int | None = None
        self.ready = True
        self._clock = clock
        self._deliver = deliver
        self._closing: asyncio.Task[None] | None = None
        self._latency: UserLatency | None = None
        self._timer: asyncio.TimerHandle | None = None
        self._running = False

    @property
    def clear(self) -> bool:
        """Whether all that was written has left the process."""
        transport = self.ws.transport
        return self.ready and not transport.is_closing() and transport.get_write_buffer_size() == 0

    @property
    def latency(self) -> tuple[float, float]:
        """Injected delay and jitter, each way [s]."""
        return (self._latency.delay, self._latency.jitter) if self._latency else (0.0, 0.0)

    def set_latency(self, delay: float, jitter: float) -> None:
        """Delay what comes and goes from now on [s]."""
        if self._latency is None:
            self._latency = UserLatency(seed=self.user or 0)
        self._latency.set(delay, jitter)
        self._run()

    def receive(self, data: Data) -> None:
        """A message from the peer, to be delivered now or when its delay is over."""
        if self._latency is None:
            self._deliver(self, data)
        else:
            self._push(self._latency.push_up, data)

    def flush(self) -> None:
        """Write what may be written, without waiting; begin the close of an ended session."""
        for data in self.session.take(clear=self.clear):
            if self._latency is None:
                broadcast([self.ws], data)
            else:
                self._push(self._latency.push_down, data)
        if self.session.close is not None and self._closing is None:
            self._let_out()
            # The close ends `recv` in the handler, which does the rest.
            closing = self.ws.close(*self.session.close)
            self._closing = asyncio.get_running_loop().create_task(closing)

    def fail(self, error: ProtocolError) -> None:
        """End the session because of `error`."""
        self.session.fail(error)
        self.flush()

    def take_rest(self) -> None:
        """The peer is gone: what it said before still counts."""
        if self._timer is not None:
            self._timer.cancel()
        if self._latency is not None:
            latency, self._latency = self._latency, None
            for data in latency.due_up(float("inf")):
                self._deliver(self, data)

    async def closed(self) -> None:
        """Wait for a close that was begun to be over."""
        if self._closing is not None:
            await self._closing

    def _push(self, push: Callable[[Data, float], None], data: Data) -> None:
        try:
            push(data, self._clock.now())
        except LinkOverflow as error:
            limit = f"fewer within the injected delay: {error}"
            self.fail(RemoteProtocolError("messages", "too many", limit, CloseCode.TOO_SLOW))
        self._run()

    def _run(self) -> None:
        """Pass on what is due, and come back for what is not."""
        latency = self._latency
        # What is delivered may bring an answer, which waits its turn behind the rest.
        if latency is None or self._running:
            return
        self._running = True
        now = self._clock.now()
        for data in latency.due_up(now):
            self._deliver(self, data)
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
            return  # newest wins: the next one is a tick away
        broadcast([self.ws], data)

    def _let_out(self) -> None:
        """What was said before the end comes before the close."""
        if self._latency is not None:
            for data in self._latency.due_down(float("inf")):
                broadcast([self.ws], data)
