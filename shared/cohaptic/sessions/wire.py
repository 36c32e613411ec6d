"""The encoding of protobuf, as far as a session file needs it. Functions of bytes.

A table names the fields of a message. From the same table come the bytes of a message, its values
again, and the description that the file carries, so that programs without our code decode it. The
library of protobuf would do the same; it is large, and only the tests need it.

Repeated numbers are packed, which is what a column of rows is: its bytes go in and out as they are.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import cached_property
from typing import Any


class Kind(Enum):
    """Type of a field; the value is its number in `descriptor.proto`."""

    DOUBLE = 1
    UINT = 4  # uint64
    STRING = 9
    MESSAGES = 11  # repeated
    BYTES = 12
    ENUM = 14
    STRINGS = 109  # repeated; numbers above 100 stand for a repeated field of the number less 100
    DOUBLES = 101  # packed, as little-endian bytes
    FLOATS = 102  # packed, as little-endian bytes


@dataclass(frozen=True, slots=True)
class Field:
    """Field of a message.

    Args:
        number: Number of the field.
        name: Name of the field.
        kind: Its type.
        of: Message of which the field has some, if its kind is MESSAGES.
    """

    number: int
    name: str
    kind: Kind
    of: Message | None = None


@dataclass(frozen=True)
class Message:
    """Table of a message's fields."""

    name: str
    fields: tuple[Field, ...]

    @cached_property
    def encoders(self) -> tuple[Encoder, ...]:
        """What appends each field; found once, as looking it up takes longer than to encode it."""
        return tuple(_encoder(field) for field in self.fields)

    @cached_property
    def by_number(self) -> dict[int, Field]:
        """The fields by number."""
        return {field.number: field for field in self.fields}


Encoder = Callable[[list[bytes], Any], None]
_DOUBLE = struct.Struct("<d")
_ZERO = _DOUBLE.pack(0.0)
_VARINT, _FIXED64, _LENGTH, _FIXED32 = 0, 1, 2, 5
_WIRE = {Kind.DOUBLE: _FIXED64, Kind.UINT: _VARINT, Kind.ENUM: _VARINT}
_LARGEST_VARINT = 10  # bytes of 64 bits, seven each


def encode(message: Message, values: Sequence[Any]) -> bytes:
    """Return the bytes of a message.

    Args:
        message: Its table.
        values: Values in the order of the fields: float, int, str, bytes, a sequence of str, or for
            a field of messages a sequence of such values.

    Raises:
        ValueError: A number is negative or has more than 64 bits.
        TypeError: A value has another type.
    """
    parts = list[bytes]()
    try:
        for append, value in zip(message.encoders, values, strict=True):
            append(parts, value)
    except (struct.error, AttributeError) as error:
        raise TypeError(f"a value of {message.name} has another type: {error}") from error
    return b"".join(parts)


def _encoder(field: Field) -> Encoder:
    """Return what appends a field to a message; proto3 leaves out zero and what is empty."""
    kind, of = field.kind, field.of
    key = _varint(field.number << 3 | _WIRE.get(kind, _LENGTH))

    def double(parts: list[bytes], value: float) -> None:
        data = _DOUBLE.pack(value)
        if data != _ZERO:
            parts += (key, data)

    def number(parts: list[bytes], value: int) -> None:
        if value:
            parts += (key, _varint(value))

    def data(parts: list[bytes], value: bytes) -> None:
        if value:
            parts += (key, _varint(len(value)), value)

    def text(parts: list[bytes], value: str) -> None:
        data(parts, value.encode())

    def texts(parts: list[bytes], values: Sequence[str]) -> None:
        for value in values:
            coded = value.encode()
            parts += (key, _varint(len(coded)), coded)

    def messages(parts: list[bytes], values: Sequence[Sequence[Any]]) -> None:
        assert of is not None
        for value in values:
            coded = encode(of, value)
            parts += (key, _varint(len(coded)), coded)

    found: dict[Kind, Encoder] = {
        Kind.DOUBLE: double, Kind.UINT: number, Kind.ENUM: number, Kind.STRING: text,
        Kind.STRINGS: texts, Kind.MESSAGES: messages,
    }  # fmt: skip
    return found.get(kind, data)


def _varint(value: int) -> bytes:
    if 0 <= value < 128:
        return _SHORT[value]
    if not 0 <= value < 1 << 64:
        raise ValueError(f"{value} is no number of 64 bits")
    parts = bytearray()
    while value >= 128:
        parts.append(value & 127 | 128)
        value >>= 7
    parts.append(value)
    return bytes(parts)


_SHORT = tuple(bytes([value]) for value in range(128))
_EMPTY: dict[Kind, Any] = {
    Kind.DOUBLE: 0.0, Kind.UINT: 0, Kind.ENUM: 0, Kind.STRING: "", Kind.BYTES: b"",
    Kind.DOUBLES: b"", Kind.FLOATS: b"",
}  # fmt: skip


def decode(message: Message, data: bytes) -> tuple[Any, ...]:
    """Return the values of a message in the order of its fields, as for `encode`.

    Unknown fields are passed over. What is returned is no larger than a few times the data.

    Raises:
        ValueError: The bytes are no such message.
    """
    found: dict[int, Any] = {}
    known = message.by_number
    for number, wire, value in _fields(data):
        field = known.get(number)
        if field is None:
            continue
        kind = field.kind
        expected = _WIRE.get(kind, _LENGTH)
        if wire != expected:
            raise ValueError(f"the field {field.name} has another type")
        match kind:
            case Kind.STRING:
                found[number] = value.decode()
            case Kind.STRINGS:
                found.setdefault(number, []).append(value.decode())
            case Kind.MESSAGES:
                assert field.of is not None
                found.setdefault(number, []).append(decode(field.of, value))
            case Kind.DOUBLES | Kind.FLOATS:
                width = 8 if kind is Kind.DOUBLES else 4
                if len(value) % width:
                    raise ValueError(f"the field {field.name} ends within a number")
                found[number] = value
            case Kind.DOUBLE:
                found[number] = _DOUBLE.unpack(value)[0]
            case _:
                found[number] = value
    return tuple(found.get(field.number, _EMPTY.get(field.kind, ())) for field in message.fields)


def _fields(data: bytes) -> list[tuple[int, int, Any]]:
    """Split a message into numbers of fields, wire types and values.

    Raises:
        ValueError: The bytes are no message.
    """
    found, at, size = list[tuple[int, int, Any]](), 0, len(data)
    while at < size:
        key, at = _read_varint(data, at)
        number, wire = key >> 3, key & 7
        if wire == _VARINT:
            value, at = _read_varint(data, at)
            found.append((number, wire, value))
            continue
        if wire == _LENGTH:
            length, at = _read_varint(data, at)
        elif wire in (_FIXED64, _FIXED32):
            length = 8 if wire == _FIXED64 else 4
        else:
            raise ValueError(f"a field has the unknown type {wire}")
        if at + length > size:
            raise ValueError("a field ends behind its message")
        found.append((number, wire, data[at : at + length]))
        at += length
    return found


def _read_varint(data: bytes, at: int) -> tuple[int, int]:
    value = 0
    for i in range(_LARGEST_VARINT):
        if at + i >= len(data):
            raise ValueError("a number ends behind its message")
        byte = data[at + i]
        value |= (byte & 127) << 7 * i
        if byte < 128:
            return value & (1 << 64) - 1, at + i + 1
    raise ValueError("a number has more than 64 bits")


# The part of `descriptor.proto` that describes our messages.
_FIELD = Message(
    "FieldDescriptorProto",
    (
        Field(1, "name", Kind.STRING),
        Field(3, "number", Kind.UINT),
        Field(4, "label", Kind.ENUM),
        Field(5, "type", Kind.ENUM),
        Field(6, "type_name", Kind.STRING),
    ),
)
_MESSAGE = Message(
    "DescriptorProto",
    (Field(1, "name", Kind.STRING), Field(2, "field", Kind.MESSAGES, _FIELD)),
)
_FILE = Message(
    "FileDescriptorProto",
    (
        Field(1, "name", Kind.STRING),
        Field(2, "package", Kind.STRING),
        Field(4, "message_type", Kind.MESSAGES, _MESSAGE),
        Field(12, "syntax", Kind.STRING),
    ),
)
_SET = Message("FileDescriptorSet", (Field(1, "file", Kind.MESSAGES, _FILE),))
_OPTIONAL, _REPEATED = 1, 3


def description(package: str, message: Message) -> bytes:
    """Return the `FileDescriptorSet` of a message and of those within it.

    Args:
        package: Package of the message's full name, such as "cohaptic".
        message: Its table.
    """
    tables = list(_within(message).values())
    described = [(table.name, [_described(package, field) for field in table.fields])
                 for table in tables]  # fmt: skip
    file = (f"{package}/{message.name}.proto", package, described, "proto3")
    return encode(_SET, [[file]])


def _within(message: Message) -> dict[str, Message]:
    found = {message.name: message}
    for field in message.fields:
        if field.of is not None:
            found |= _within(field.of)
    return found


def _described(package: str, field: Field) -> tuple[str, int, int, int, str]:
    number = field.kind.value
    repeated = number > 100 or field.kind is Kind.MESSAGES
    of = f".{package}.{field.of.name}" if field.of else ""
    return field.name, field.number, _REPEATED if repeated else _OPTIONAL, number % 100, of
