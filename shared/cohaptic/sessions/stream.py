"""Entries of a session on their way from the server to a program that keeps the file.

A message has any number of entries, each as `u8 channel, u32 length` and the bytes that the file
has; `channel` is its place in `schemas.CHANNELS`.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable
from typing import Literal

from pydantic import Field, TypeAdapter, ValidationError

from cohaptic.errors import RemoteProtocolError
from cohaptic.protocol.control.message import ControlMessage, WithSecrets
from cohaptic.protocol.messages import Error, Mark, Token, decode_text
from cohaptic.sessions.codec import decode, encode
from cohaptic.sessions.entries import LARGEST, LeftOut, Written
from cohaptic.sessions.schemas import CHANNELS

SUBPROTOCOL = "cohaptic.record.v1"
_HEAD = struct.Struct("<BI")
# Bytes of a message: one entry of the largest size fits in.
MAX_BYTES = LARGEST + _HEAD.size
_PLACES = {channel.entry: i for i, channel in enumerate(CHANNELS)}


class RecordRequest(WithSecrets):
    """First message of a program that wants to keep a recording.

    Args:
        token: As in a hello.
    """

    type: Literal["record"] = "record"
    token: Token | None = Field(default=None, repr=False)


class EndRecording(ControlMessage):
    """Last message of the program; the rest of the entries follows, and then the close."""

    type: Literal["end_recording"] = "end_recording"


Request = RecordRequest | EndRecording | Mark
_REQUESTS: TypeAdapter[Request] = TypeAdapter(Request)
_ERRORS: TypeAdapter[Error] = TypeAdapter(Error)


def decode_request(text: str) -> Request:
    """Decode a message of the program; raises RemoteProtocolError for any invalid text."""
    return decode_text(_REQUESTS, text)


def decode_error(text: str) -> Error:
    """Decode a text of the server; raises RemoteProtocolError for any invalid one."""
    return decode_text(_ERRORS, text)


def encode_batch(entries: Iterable[Written]) -> list[bytes]:
    """Return messages with these entries; one that no file can hold is counted as left out."""
    messages, parts, size, newest = list[bytes](), list[bytes](), 0, 0.0
    for entry in entries:
        try:
            data = encode(entry)
        except (ValueError, TypeError):
            entry = LeftOut(newest, 1)
            data = encode(entry)
        newest = entry.t
        if parts and size + len(data) > LARGEST:
            messages.append(b"".join(parts))
            parts, size = [], 0
        parts += (_HEAD.pack(_PLACES[type(entry)], len(data)), data)
        size += _HEAD.size + len(data)
    return [*messages, b"".join(parts)] if parts else messages


def decode_batch(message: bytes) -> list[Written]:
    """Return the entries of a message.

    Raises:
        RemoteProtocolError: No server sends such a message.
    """
    entries, at = list[Written](), 0
    while at < len(message):
        if at + _HEAD.size > len(message):
            raise RemoteProtocolError("entry", f"{len(message) - at} bytes", "a whole head")
        place: int
        length: int
        place, length = _HEAD.unpack_from(message, at)
        at += _HEAD.size
        if place >= len(CHANNELS) or at + length > len(message):
            found = f"channel {place} of {length} bytes"
            raise RemoteProtocolError("entry", found, "a known channel, and all of its bytes")
        try:
            entries.append(decode(CHANNELS[place], message[at : at + length]))
        except (ValueError, ValidationError) as error:
            raise RemoteProtocolError(
                "entry", str(error)[:200], "one that a server sends"
            ) from error
        at += length
    return entries
