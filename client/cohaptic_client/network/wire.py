"""A websocket whose samples and patches bypass the parser, queue and tasks of `websockets`.

At 60 samples and patches per second, the library took a third of the time of the network process.
Here the server's stream of bytes is cut into websocket frames, and a patch is delivered as soon as
its frame is complete. Other frames go to the library, which checks them. While one of their
messages waits for `recv`, patches go through the library, too, so that messages stay in order. An
outgoing message is written as a finished frame.

A hostile stream cannot fill the memory: the incomplete frame that is kept has at most `LONGEST`
bytes of payload.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any, NamedTuple

from websockets.asyncio.client import ClientConnection
from websockets.protocol import State

from cohaptic.protocol.websocket_frames import (
    BINARY,
    END_OF_HEAD,
    KEY,
    begins_message,
    make_frame,
    read_head,
)
from cohaptic.runtime.transport import unsent_of

# Largest payload that is kept until it is complete [bytes]: a few of the largest patches. Parts of
# a longer one, such as a rest mesh, are passed on at once.
LONGEST = 4096


class Piece(NamedTuple):
    """A part of the server's stream: a websocket frame, or a part of a long frame.

    Args:
        data: Bytes of the stream, unchanged.
        patch: Payload of a whole binary message without mask; None in all other pieces.
        begins: Whether a message begins with this piece.
    """

    data: bytes
    patch: bytes | None
    begins: bool


class ServerStream:
    """Cuts the bytes that the server sends after the handshake into pieces (`Piece`)."""

    def __init__(self) -> None:
        self._rest: bytes = b""  # beginning of a frame that is not yet complete
        self._passing = 0  # bytes of a long frame that are still to come

    def cut(self, data: bytes) -> list[Piece]:
        """Return the pieces that `data` completes; all pieces joined in order give the stream."""
        found: list[Piece] = []
        if self._passing:
            passed = data[: self._passing]
            found.append(Piece(passed, None, begins=False))
            self._passing -= len(passed)
            data = data[len(passed) :]
        elif self._rest:
            data, self._rest = self._rest + data, b""
        at, end = 0, len(data)
        while at < end:
            head = read_head(data, at)
            if head is None:
                break
            stop = at + head.size + head.payload
            if stop > end and head.payload <= LONGEST:
                break
            frame = data[at:stop]
            patch = None
            if frame[0] == BINARY and not head.masked and head.payload <= LONGEST:
                patch = frame[head.size :]
            found.append(Piece(frame, patch, begins_message(frame)))
            self._passing = max(0, stop - end)
            at = min(stop, end)
        self._rest = data[at:]
        return found


_KEYS = 256  # masking keys that one call draws from the system: for 4 s of samples


class Wire(ClientConnection):
    """The websocket connection to a server.

    Attributes:
        deliver: Function that is called with each small binary message; None leaves all messages to
            `recv`.
    """

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self.deliver: Callable[[bytes], None] | None = None
        self._stream: ServerStream | None = None  # once the handshake is over
        # Last bytes of the answer to the handshake so far; None once its end has been found.
        self._head: bytes | None = b""
        self._waiting = 0  # messages in the library for which `taken` was not called yet
        self._keys = b""
        self._unsent: Callable[[], int] | None = None

    def taken(self) -> None:
        """Note that the caller is done with a message from `recv`; call it after each `recv`."""
        self._waiting -= 1

    def write(self, message: str | bytes) -> None:
        """Write a message without waiting; do nothing once the closing has begun."""
        if self.state is State.OPEN:
            self.transport.write(make_frame(message, self._key()))

    @property
    def unsent(self) -> int:
        """Number of written bytes that the operating system has not taken yet."""
        if self._unsent is None:
            self._unsent = unsent_of(self.transport)
        return self._unsent()

    def data_received(self, data: bytes) -> None:
        """Handle bytes from the server; the event loop calls this."""
        if self._stream is None:
            data = self._opening(data)
            if self._stream is None or not data:
                return
        for piece in self._stream.cut(data):
            # A message is delivered at once only if no earlier one is waiting.
            if piece.patch is not None and self.deliver is not None and not self._waiting:
                if self.state is State.OPEN:
                    self.deliver(piece.patch)
                    continue
            self._waiting += piece.begins
            super().data_received(piece.data)

    def _opening(self, data: bytes) -> bytes:
        """Pass the handshake's answer on to the library; return the bytes that follow the answer.

        An answer that refuses the handshake may have a body of any bytes, which is passed on uncut.
        """
        if self._head is None:
            super().data_received(data)
            return b""
        seen = self._head + data
        at = seen.find(END_OF_HEAD)
        if at < 0:
            self._head = seen[-len(END_OF_HEAD) + 1 :]
            super().data_received(data)
            return b""
        end = at + len(END_OF_HEAD) - len(self._head)
        self._head = None
        super().data_received(data[:end])
        if self.state is State.OPEN:
            self._stream = ServerStream()
            return data[end:]
        super().data_received(data[end:])
        return b""

    def _key(self) -> bytes:
        """Return a fresh masking key from the system's random numbers."""
        if not self._keys:
            self._keys = os.urandom(KEY * _KEYS)
        key, self._keys = self._keys[:KEY], self._keys[KEY:]
        return key
