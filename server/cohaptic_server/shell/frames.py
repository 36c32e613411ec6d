"""Cuts the byte stream of a client into whole websocket frames.

Samples are unmasked here; every other frame is passed on unchanged to `websockets`, which reads
and checks it.
"""

from __future__ import annotations

from cohaptic.protocol.websocket_frames import (
    BINARY,
    END_OF_HEAD,
    KEY,
    is_small_masked,
    mask,
    read_head,
)

# Frames in one read of a socket. After a stall of 10 s a client at 200 Hz has as many samples in
# the kernel; cutting them takes 3 ms. A read full of empty frames would take 70 ms.
MOST_FRAMES = 2048


def is_small_binary(frame: bytes) -> bool:
    """Whether a client's frame is a whole binary message of less than 126 bytes."""
    return is_small_masked(frame) and frame[0] == BINARY


def unmask(frame: bytes) -> bytes:
    """Payload of a client's frame that passed `is_small_binary`."""
    return mask(frame[2 + KEY :], frame[2 : 2 + KEY])


class ClientStream:
    """Cuts the bytes of a client into the request that opens the connection, and whole frames.

    Args:
        longest: Longest payload that is buffered until it is complete [bytes]. A longer payload, or
            a frame without a mask, is an error that the library reports; the bytes from there on
            are passed on uncut.

    Attributes:
        opened: Whether the whole request has come.
        flooded: Whether one read had more than `MOST_FRAMES` frames; the further ones are dropped.
    """

    def __init__(self, longest: int) -> None:
        self._longest = longest
        self._rest = b""  # an incomplete frame, or the last bytes of the head so far
        self.opened = self.flooded = False
        self._whole = True

    def allow(self, longest: int) -> None:
        """From now on buffer payloads of up to `longest` bytes until they are complete."""
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

    def _open(self, data: bytes) -> list[bytes]:
        """Pass on the bytes of the request, and cut frames behind its end."""
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
            if len(found) == MOST_FRAMES:
                self.flooded = True
                return found
            found.append(data[at : at + size])
            at += size
        self._rest = data[at:]
        if not self._whole and self._rest:
            found.append(self._rest)
            self._rest = b""
        return found

    def _size(self, data: bytes, at: int) -> int | None:
        """Size of the frame that begins at `at` [bytes]; None if its header is not complete."""
        head = read_head(data, at)
        if head is None:
            return None
        if head.payload > self._longest or not head.masked:
            self._whole = False
            return None
        return head.size + head.payload
