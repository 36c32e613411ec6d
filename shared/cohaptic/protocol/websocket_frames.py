"""Frames of RFC 6455 for the messages at the simulation rate.

Both ends read and write these frames themselves and leave every other frame to `websockets`, which
also checks them. The parser, queue and tasks of `websockets` cost more than all the work on a
sample or a patch.
"""

from __future__ import annotations

import struct
from typing import NamedTuple

TEXT, BINARY = 0x81, 0x82  # whole messages, with the bit that marks the last frame of a message
SMALL = 126  # smallest payload whose length has a field of its own [bytes]
KEY = 4  # bytes of the masking key, which every frame of a client has
END_OF_HEAD = b"\r\n\r\n"  # ends the request that opens a connection, and the answer to it
_MASKED = 0x80
_MEDIUM, _LONG = struct.Struct("!BBH"), struct.Struct("!BBQ")


class Head(NamedTuple):
    """Header of a frame.

    Args:
        size: Size of the header, with the masking key if the frame has one [bytes].
        payload: Size of the payload behind the header [bytes].
        masked: Whether the frame has a masking key.
    """

    size: int
    payload: int
    masked: bool


def read_head(data: bytes, at: int) -> Head | None:
    """The header of the frame that begins at `at`; None while the header is incomplete."""
    head = data[at : at + 10]
    if len(head) < 2:
        return None
    payload, size, masked = head[1] & 0x7F, 2, bool(head[1] & _MASKED)
    if payload >= SMALL:
        size = 4 if payload == SMALL else 10
        if len(head) < size:
            return None
        payload = int.from_bytes(head[2:size], "big")
    return Head(size + KEY if masked else size, payload, masked)


def make_frame(data: str | bytes, key: bytes = b"") -> bytes:
    """The frame of a whole message.

    Args:
        data: Text or binary message.
        key: Masking key of a client, four unpredictable bytes; empty for a server.
    """
    kind, payload = (TEXT, data.encode()) if isinstance(data, str) else (BINARY, data)
    size = len(payload)
    bit = 0
    if key:
        bit, payload = _MASKED, key + mask(payload, key)
    if size < SMALL:
        return bytes((kind, bit | size)) + payload
    if size < 1 << 16:
        return _MEDIUM.pack(kind, bit | SMALL, size) + payload
    return _LONG.pack(kind, bit | SMALL + 1, size) + payload


def mask(data: bytes, key: bytes) -> bytes:
    """Bytes masked with a key of `KEY` bytes; masking twice gives the plain bytes again."""
    size = len(data)
    keys = key * (size // KEY + 1)
    # One operation on long integers instead of one for each byte.
    masked = int.from_bytes(data, "little") ^ int.from_bytes(keys[:size], "little")
    return masked.to_bytes(size, "little")


def is_medium_masked(data: bytes) -> bool:
    """Whether the bytes are exactly one masked frame with a payload of 126 to 65,535 bytes."""
    size = len(data) - _MEDIUM.size - KEY
    return size >= SMALL and data[1] == _MASKED | SMALL and data[2:4] == size.to_bytes(2, "big")


def begins_message(frame: bytes) -> bool:
    """Whether a frame is the first (perhaps the only) frame of a text or binary message."""
    return bool(frame) and frame[0] & 0x0F in (TEXT & 0x0F, BINARY & 0x0F)


def is_small_masked(data: bytes) -> bool:
    """Whether the bytes are exactly one masked frame with a payload of less than 126 bytes."""
    size = len(data) - 2 - KEY
    return 0 <= size < SMALL and data[1] == _MASKED | size
