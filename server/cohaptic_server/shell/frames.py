"""Frames of RFC 6455 for the messages that come and go at the rate of the simulation.

A stream from a client is cut into whole frames. Of these, a sample is read here and every other
frame by `websockets`, which also checks them: what is cut here is passed on as it came. Frames to a
client are made here, so that all that a tick has for it leaves in one write.
"""

from __future__ import annotations

import struct

_TEXT, _BINARY = 0x81, 0x82  # whole messages: with the bit that says that nothing follows
_MASKED = 0x80
_MEDIUM, _LONG = struct.Struct("!BBH"), struct.Struct("!BBQ")
_SMALL = 126  # payload from which on the length has a field of its own [bytes]
_KEY = 4  # bytes of the masking key, which every frame of a client has
_END_OF_HEAD = b"\r\n\r\n"  # of the request that opens the connection


def make_frame(data: str | bytes) -> bytes:
    """The frame of a whole message to a client."""
    kind, payload = (_TEXT, data.encode()) if isinstance(data, str) else (_BINARY, data)
    size = len(payload)
    if size < _SMALL:
        return bytes((kind, size)) + payload
    if size < 1 << 16:
        return _MEDIUM.pack(kind, _SMALL, size) + payload
    return _LONG.pack(kind, _SMALL + 1, size) + payload


def is_small_binary(frame: bytes) -> bool:
    """Whether a client's frame is a whole binary message of less than 126 bytes."""
    return _is_small_frame(frame) and frame[0] == _BINARY


def unmask(frame: bytes) -> bytes:
    """Payload of a client's frame of which `is_small_binary` holds."""
    size = len(frame) - 2 - _KEY
    key = frame[2 : 2 + _KEY] * (size // _KEY + 1)
    # One operation on long integers instead of one for each byte.
    plain = int.from_bytes(frame[2 + _KEY :], "little") ^ int.from_bytes(key[:size], "little")
    return plain.to_bytes(size, "little")


def begins_message(frame: bytes) -> bool:
    """Whether a frame is the first, and perhaps the only one, of a message with data."""
    return bool(frame) and frame[0] & 0x0F in (_TEXT & 0x0F, _BINARY & 0x0F)


def _is_small_frame(data: bytes) -> bool:
    """Whether the bytes are exactly one frame with a mask and less than 126 bytes."""
    size = len(data) - 2 - _KEY
    return 0 <= size < _SMALL and data[1] == _MASKED | size


class ClientStream:
    """Cuts the bytes of a client into the request that opens the connection, and whole frames.

    Args:
        longest: Payload that may wait for its rest [bytes]. A longer one, and a frame without a
            mask, are errors that the library reports: from there on the stream is not cut any more.
    """

    def __init__(self, longest: int) -> None:
        self._longest = longest
        self._rest = b""  # begins with a frame, or has the last bytes of the head so far
        self._opened = False
        self._whole = True

    def allow(self, longest: int) -> None:
        """From now on let payloads of up to so many bytes wait for their rest."""
        self._longest = longest

    @property
    def opened(self) -> bool:
        """Whether all of the request has come."""
        return self._opened

    def cut(self, data: bytes) -> list[bytes]:
        """The pieces that are complete with `data`, in order; joined, they are the stream."""
        if not self._whole:
            return [data]
        if not self._opened:
            return self._open(data)
        if not self._rest and _is_small_frame(data):
            return [data]
        data = self._rest + data
        return self._frames(data)

    def _open(self, data: bytes) -> list[bytes]:
        """Pass on the request as it comes, and cut behind its end."""
        known = len(self._rest)
        seen = self._rest + data
        at = seen.find(_END_OF_HEAD)
        if at < 0:
            self._rest = seen[-len(_END_OF_HEAD) + 1 :]
            return [data]
        end = at + len(_END_OF_HEAD) - known
        self._opened, self._rest = True, b""
        return [data[:end], *self._frames(data[end:])]

    def _frames(self, data: bytes) -> list[bytes]:
        found: list[bytes] = []
        at = 0
        while (size := self._size(data, at)) is not None and at + size <= len(data):
            found.append(data[at : at + size])
            at += size
        self._rest = data[at:]
        if not self._whole and self._rest:
            found.append(self._rest)
            self._rest = b""
        return found

    def _size(self, data: bytes, at: int) -> int | None:
        """Size of the frame that begins at `at`; None while its header is not there."""
        head = data[at : at + 10]
        if len(head) < 2:
            return None
        size, header = head[1] & 0x7F, 2
        if size >= _SMALL:
            header = 4 if size == _SMALL else 10
            if len(head) < header:
                return None
            size = int.from_bytes(head[2:header], "big")
        if size > self._longest or not head[1] & _MASKED:
            self._whole = False
            return None
        return header + _KEY + size
