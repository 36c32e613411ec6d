"""Messages between the server and the worker of an upload, through two pipes.

A message consists of a letter for its kind, its length, and its bytes. Both processes bound the
length that they accept, since the worker makes its messages from a stranger's file.
"""

from __future__ import annotations

import json
import struct
from typing import IO, Any

_HEAD = struct.Struct("<cI")
TEXT, DATA = b"T", b"D"
MAX_MESSAGE = 2 * 2**20  # bytes; a preview of 12,000 triangles takes a tenth of this


class PipeEnded(Exception):
    """Error: the other process has ended, or has sent bytes that are not a message."""


def send(stream: IO[bytes], kind: bytes, data: bytes) -> None:
    """Write one message.

    Raises:
        PipeEnded: The other process has ended.
    """
    try:
        stream.write(_HEAD.pack(kind, len(data)))
        stream.write(data)
        stream.flush()
    except (OSError, ValueError) as error:  # ValueError: the stream is closed on this side
        raise PipeEnded(str(error)) from error


def send_text(stream: IO[bytes], **fields: Any) -> None:
    """Write one message of named values."""
    send(stream, TEXT, json.dumps(fields).encode())


def receive(stream: IO[bytes]) -> tuple[bytes, bytes]:
    """Read one message; returns its kind and its bytes.

    Raises:
        PipeEnded: The other process has ended, or the bytes are not a message.
    """
    try:
        head = stream.read(_HEAD.size)
        if len(head) < _HEAD.size:
            raise PipeEnded("it has ended")
        kind, length = _HEAD.unpack(head)
        if kind not in (TEXT, DATA) or length > MAX_MESSAGE:
            raise PipeEnded(f"{kind!r} of {length} bytes is no message")
        data = stream.read(length)
    except (OSError, ValueError) as error:
        raise PipeEnded(str(error)) from error
    if len(data) < length:
        raise PipeEnded("it has ended")
    return kind, data


def fields_of(data: bytes) -> dict[str, Any]:
    """Return the named values of a text message.

    Raises:
        PipeEnded: The message has no named values.
    """
    try:
        fields = json.loads(data)
    except (ValueError, RecursionError) as error:
        raise PipeEnded("what came is no text") from error
    if not isinstance(fields, dict):
        raise PipeEnded("what came has no names")
    return {str(name): value for name, value in fields.items()}  # pyright: ignore[reportUnknownVariableType, reportUnknownArgumentType]
