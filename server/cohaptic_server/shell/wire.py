"""A websocket that delivers samples past the parser, the queue and the task of the library.

At 60 messages per second and user, these three take more time than all that the server does with a
sample. Here the byte stream of a client is cut into whole frames, and the frame of a sample is
delivered unchanged (`unmask` gives its payload). Every other frame is passed on to `websockets`,
which reads and checks it. While such a message waits for the handler, samples go through the
library as well, so that messages stay in order.

If a client exceeds a rate limit, the server reads no more from it, sends the reason and
disconnects.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from typing import Any

from websockets.asyncio.server import ServerConnection
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed
from websockets.frames import CloseCode as StandardCode
from websockets.protocol import State

from cohaptic.clock import SystemClock, thread_time
from cohaptic.errors import CloseCode, ProtocolError, RemoteProtocolError, one_line
from cohaptic.protocol.fields import FrameKind
from cohaptic.protocol.websocket_frames import (
    BINARY,
    END_OF_HEAD,
    KEY,
    SMALL,
    begins_message,
    is_medium_masked,
    is_small_masked,
    make_frame,
    mask,
    read_head,
)
from cohaptic.runtime.transport import unsent_of
from cohaptic.status.row_batch import MAX_BYTES
from cohaptic_server.guard.limits import Limits
from cohaptic_server.guard.sources import Refusal
from cohaptic_server.room.session import close_frame
from cohaptic_server.shell.limiter import ConnectionLimiter

# Frames in one read of a socket. After a stall of 10 s a client at 200 Hz has as many samples in
# the kernel; cutting them takes 3 ms. A read full of empty frames would take 70 ms.
MAX_FRAMES = 2048


_BINARY = bytes((BINARY,))
_LONGEST = 4 + KEY + MAX_BYTES  # bytes of the longest frame of rows


def is_small_binary(frame: bytes) -> bool:
    """Whether a client's frame is a whole binary message of less than 126 bytes."""
    return is_small_masked(frame) and frame[0] == BINARY


def is_medium_binary(frame: bytes) -> bool:
    """Whether a client's frame is a whole binary message of 126 bytes or more, such as rows.

    One that is longer than any of a user's messages is left to the library, which refuses it.
    """
    fits = len(frame) <= _LONGEST
    return fits and frame[:1] == _BINARY and is_medium_masked(frame)


def is_rows(frame: bytes) -> bool:
    """Whether a frame that passed one of the two functions above has rows, by its second byte."""
    head = 4 if frame[1] & 0x7F == SMALL else 2
    kind = head + KEY + 1
    return len(frame) > kind and frame[kind] ^ frame[head + 1] == FrameKind.ROWS


def unmask(frame: bytes) -> bytes:
    """Return the payload of a client's frame that passed one of the two functions above."""
    head = 4 if frame[1] & 0x7F == SMALL else 2
    return mask(frame[head + KEY :], frame[head : head + KEY])


class ClientStream:
    """Cuts a client's bytes into the HTTP request that opens the connection, and whole frames.

    Args:
        longest: Longest payload that is buffered until it is complete [bytes]. A longer payload, or
            a frame without a mask, is an error that the library reports; the bytes from there on
            are passed on uncut.

    Attributes:
        opened: Whether the whole request has come.
        flooded: Whether one read had more than `MAX_FRAMES` frames; `rest` returns the further
            ones.
    """

    def __init__(self, longest: int) -> None:
        self._longest = longest
        self._rest = b""  # an incomplete frame, or the last bytes of the head so far
        self.opened = self.flooded = False
        self._whole = True

    def allow(self, longest: int) -> None:
        """Buffer payloads of up to `longest` bytes from now on until they are complete."""
        self._longest = longest

    def cut(self, data: bytes) -> list[bytes]:
        """Return the pieces that `data` completes, in order; all pieces joined are the stream."""
        if not self._whole:
            return [data]
        if not self.opened:
            return self._open(data)
        if not self._rest and is_small_masked(data):
            return [data]
        data = self._rest + data
        return self._frames(data)

    def rest(self) -> list[bytes]:
        """Return all further frames of a read that had too many."""
        found: list[bytes] = []
        while self.flooded:
            self.flooded = False
            found += self._frames(self._rest)
        return found

    def _open(self, data: bytes) -> list[bytes]:
        """Return the bytes of the request, and the whole frames behind its end."""
        known = len(self._rest)
        seen = self._rest + data
        at = seen.find(END_OF_HEAD)
        if at < 0:
            self._rest = seen[-len(END_OF_HEAD) + 1 :]
            return [data]
        end = at + len(END_OF_HEAD) - known
        self.opened, self._rest = True, b""
        return [data[:end], *self._frames(data[end:])]

    def _frames(self, data: bytes) -> list[bytes]:
        found: list[bytes] = []
        at = 0
        while (size := self._size(data, at)) is not None and at + size <= len(data):
            if len(found) == MAX_FRAMES:
                self.flooded, self._rest = True, data[at:]
                return found
            found.append(data[at : at + size])
            at += size
        self._rest = data[at:]
        if not self._whole and self._rest:
            found.append(self._rest)
            self._rest = b""
        return found

    def _size(self, data: bytes, at: int) -> int | None:
        """Return the size of the frame that begins at `at` [bytes]; None if its head is cut off."""
        head = read_head(data, at)
        if head is None:
            return None
        if head.payload > self._longest or not head.masked:
            self._whole = False
            return None
        return head.size + head.payload


MAX_INBOUND_BYTES = 4096  # several times the largest inbound message, a hello
MAX_UNREAD_BYTES = 256 * 1024  # sent but not read by a peer that pings; more than any one message
HEAD_TIMEOUT = 5.0  # s for the request that opens a connection, as for a hello
_LAST_WORDS = 0.3  # s for the close frame to leave this machine; then the connection is cut
_CONTROL = 0x08  # bit of the opcode of a ping, pong or close


class Wire(ServerConnection):
    """The websocket connection to one client.

    Args:
        limiter: Limiter with the rate limits of the server; None makes a limiter for
            this connection alone.

    Attributes:
        deliver: Called with the frame of each small binary message that comes while no message
            waits for the handler; None leaves all messages to `recv`.
        dismiss: Called with the error when the server stops reading from a peer; has to close the
            connection.
        source: Source against whose rate limits the connection counts.
    """

    def __init__(
        self, *args: Any, limiter: ConnectionLimiter | None = None, **options: Any
    ) -> None:
        super().__init__(*args, **options)
        self.deliver: Callable[[bytes], None] | None = None
        self.dismiss: Callable[[ProtocolError], None] = self._close_for
        self.source = ""
        self._unsent: Callable[[], int] | None = None
        self._limiter = limiter or ConnectionLimiter(Limits(), SystemClock())
        self._now = self._limiter.clock.now
        self._meter = self._limiter.meter()
        self._pardoned = 0  # the newest pardon that this connection has had
        self._traffic = self._limiter.traffic
        self._stream = ClientStream(MAX_INBOUND_BYTES)
        self._waiting = 0  # messages in the library that the handler has not taken
        self._deaf = self._brings_files = False
        self._unread = 0  # bytes of responses that `sources` counts as unread
        self._head_due: asyncio.TimerHandle | None = None

    def allow(self, longest: int, *, as_fast_as_served: bool) -> None:
        """Accept messages of up to `longest` bytes from now on.

        Args:
            longest: Largest message [bytes].
            as_fast_as_served: Whether messages other than samples and pings are free of rate
                limits, because the handler limits their rate.
        """
        self._stream.allow(longest)
        self.protocol.max_message_size = longest
        self._brings_files = as_fast_as_served

    def count_response(self, size: int) -> None:
        """Count the bytes of a response that `Sources.respond` has allowed."""
        self._unread += size
        self._traffic.sent += size

    def come_from(self, headers: Headers) -> Refusal | None:
        """Count a connection from a trusted proxy against the visitor whom its headers name.

        Args:
            headers: Headers of the request; used only if a trusted proxy has sent them, since any
                other client can write arbitrary addresses into them.

        Returns:
            The refusal; None if the connection is admitted.
        """
        if self.source not in self._limiter.proxies:
            return None
        file = self.transport.get_extra_info("socket").fileno()
        said = [headers.get_all(name) for name in ("X-Forwarded-For", "Forwarded")]
        settled = self._limiter.settle(file, self.source, said, self._now())
        if isinstance(settled, str):
            self.source = settled
            return None
        return settled

    def taken(self) -> None:
        """Note that the handler has finished a message from `recv`; samples may bypass it again."""
        self._waiting -= 1

    def write(self, messages: list[str | bytes]) -> None:
        """Write messages in one system call, without waiting; drop them if the close has begun."""
        if messages and self.state is State.OPEN:
            data = b"".join(map(make_frame, messages))
            self._traffic.sent += len(data)
            self.transport.write(data)

    async def send(self, message: Any, **options: Any) -> None:
        """Send a message as the library does, which may wait for the peer; count its bytes."""
        whole = isinstance(message, str | bytes)
        self._traffic.sent += len(message) if whole else sum(map(len, message))
        await super().send(message, **options)

    def unsent(self) -> int:
        """Return the number of written bytes that the operating system has not taken yet."""
        if self._unsent is None:
            self._unsent = unsent_of(self.transport)
        return self._unsent()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Start the time-out of the request; the event loop calls this for a new connection."""
        taken = self._limiter.taken.get(transport.get_extra_info("socket").fileno())
        if taken is None:
            self.source = self._limiter.source_of_peer(transport.get_extra_info("peername"))
        else:
            self.source = taken.source
            taken.turns = None  # the TLS handshake is over
        super().connection_made(transport)
        loop = asyncio.get_running_loop()
        self._head_due = loop.call_later(HEAD_TIMEOUT, self._cut)

    def connection_lost(self, exc: Exception | None) -> None:
        """Clear timers and counters; the event loop calls this when the connection has ended."""
        if self._head_due is not None:
            self._head_due.cancel()
        self._limiter.sources.taken(self.source, self._unread)
        self._unread = 0
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Deliver samples and pass other bytes to the library; the event loop calls this."""
        if self._deaf:
            self.transport.pause_reading()  # the library may have resumed it
            return
        in_head = not self._stream.opened
        pieces = self._stream.cut(data)
        deliver = self.deliver
        error: ProtocolError | None
        alone = len(pieces) == 1 and is_small_binary(pieces[0])
        if alone and not self._stream.flooded:
            # `is_small_binary` ensures a whole frame: 6 bytes and the payload. This fast path
            # avoids function calls, since each call would be made once per sample.
            self._traffic.received += 6 + (pieces[0][1] & 0x7F)
            error = self._meter.sample(self._now())
            if error is None and deliver is not None and not self._waiting:
                if self.protocol.state is State.OPEN:
                    deliver(pieces[0])
                    return
        else:
            self._traffic.received += sum(map(len, pieces))
            error = self._excess(pieces, in_head=in_head)
        if error is not None:
            pardon = self._limiter.pardon(self._now(), thread_time())
            # Only a hand has something to say at each tick, and a room has few of them.
            if deliver is None or pardon <= self._pardoned:
                self._stop_hearing(error)
                return
            # All of it came while this process could not read.
            self._pardoned = pardon
            pieces += self._stream.rest()
            self._meter = self._limiter.meter()
        for piece in pieces:
            # No earlier message may still wait when a sample is delivered at once.
            is_whole = is_small_binary(piece) or is_medium_binary(piece)
            if self.deliver is not None and not self._waiting and is_whole:
                if self.state is State.OPEN:
                    self.deliver(piece)
                    continue
            self._waiting += not in_head and begins_message(piece)
            in_head = False
            super().data_received(piece)

    def _excess(self, pieces: Sequence[bytes], *, in_head: bool) -> ProtocolError | None:
        """Count the pieces of one read; return an error if they exceed a rate limit, or None."""
        if self._stream.flooded:
            limit = f"at most {MAX_FRAMES}"
            return RemoteProtocolError("frames in one read", "more", limit, CloseCode.TOO_MANY)
        samples = rows = texts = beats = 0
        for piece in pieces[1:] if in_head else pieces:
            if piece and piece[0] & _CONTROL:
                beats += 1
            elif is_small_binary(piece):
                samples += 1
            elif is_medium_binary(piece):
                rows += 1
            else:
                texts += 1
        # The handler limits the rate of a file's pieces, so that no rate limit applies to them.
        if self._brings_files:
            rows = texts = 0
        if beats and self.unsent() > MAX_UNREAD_BYTES:
            limit = f"at most {MAX_UNREAD_BYTES:,}"
            return RemoteProtocolError("bytes not read", "more", limit, CloseCode.TOO_SLOW)
        if in_head and self._stream.opened and self._head_due is not None:
            self._head_due.cancel()
        now = self._now()
        error = self._meter.read(samples, rows, texts, beats, now)
        return error or (self._limiter.sources.say(self.source, texts, now) if texts else None)

    def _stop_hearing(self, error: ProtocolError) -> None:
        self._deaf = True
        self.transport.pause_reading()
        self._limiter.sources.dismiss(self.source, self._now())
        self._traffic.spent[error.subject] += 1
        sentence = f"{self.source} asked for too much: {error}"
        self._limiter.tell(self.source, "budget_spent", sentence, warning=True)
        if self.state is not State.OPEN:
            self.transport.abort()
            return
        # The last message gets time to leave. No answer to the close can come, since nothing is
        # read any more.
        asyncio.get_running_loop().call_later(_LAST_WORDS, self.transport.abort)
        self.dismiss(error)

    def _close_for(self, error: ProtocolError) -> None:
        closing = self.close(*close_frame(error.code.value, str(error)))
        self._closing = asyncio.get_running_loop().create_task(closing)

    def _cut(self) -> None:
        """Cut the connection if its request has not come in time."""
        if not self._stream.opened:
            self._traffic.refused["no request"] += 1
            sentence = f"{self.source} sent no request in {HEAD_TIMEOUT:g} s"
            self._limiter.tell(self.source, "no_request", sentence)
            self.transport.abort()


# Of a peer that goes, also without a word.
_USUAL = (StandardCode.NORMAL_CLOSURE, StandardCode.GOING_AWAY)


def last_words(closed: ConnectionClosed) -> tuple[bool, str]:
    """Return whether the peer itself closed the connection, and the reason of the close.

    The reason, one line of text, comes from the peer, or is the error that the library found in the
    peer's messages. The text is empty if there is no reason, or if the connection was lost because
    the peer has answered no ping.
    """
    rcvd, sent = closed.rcvd, closed.sent
    if rcvd is not None and closed.rcvd_then_sent is not False:
        usual = "closed" if rcvd.code in _USUAL else ""
        return True, one_line(rcvd.reason) or usual
    # The peer's answer to a close of our own says nothing about the reason.
    if sent is None or sent.code == StandardCode.INTERNAL_ERROR:
        return False, ""
    return False, one_line(sent.reason)
