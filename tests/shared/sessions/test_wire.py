"""Our encoding of protobuf, against the library of protobuf itself."""

from __future__ import annotations

import struct
from typing import Any

import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.sessions.schemas import LINK, PATCHED, ROWS, SHOWN
from cohaptic.sessions.wire import Field, Kind, Message, decode, description, encode

INNER = Message("Inner", (Field(1, "n", Kind.UINT), Field(2, "xs", Kind.DOUBLES)))
ALL = Message(
    "All",
    (
        Field(1, "t", Kind.DOUBLE),
        Field(2, "n", Kind.UINT),
        Field(3, "text", Kind.STRING),
        Field(4, "data", Kind.BYTES),
        Field(5, "words", Kind.STRINGS),
        Field(6, "doubles", Kind.DOUBLES),
        Field(700, "floats", Kind.FLOATS),
        Field(8, "inner", Kind.MESSAGES, INNER),
    ),
)
numbers = st.floats(allow_nan=False)
doubles = st.lists(numbers, max_size=4).map(lambda xs: struct.pack(f"<{len(xs)}d", *xs))
floats = st.lists(st.floats(width=32, allow_nan=False), max_size=4).map(
    lambda xs: struct.pack(f"<{len(xs)}f", *xs)
)
uints = st.integers(0, 2**64 - 1)
values = st.tuples(
    numbers, uints, st.text(), st.binary(), st.lists(st.text(), max_size=3), doubles, floats,
    st.lists(st.tuples(uints, doubles), max_size=3),
)  # fmt: skip


def theirs(message: Message) -> Any:
    """The class that the library of protobuf makes of the description in a file."""
    found = descriptor_pb2.FileDescriptorSet.FromString(description("cohaptic", message))
    pool = descriptor_pool.DescriptorPool()
    for file in found.file:
        pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(f"cohaptic.{message.name}"))


@given(values)
def test_others_read_what_we_write_and_we_read_what_they_write(values: tuple[Any, ...]) -> None:
    t, n, text, data, words, doubles, floats, inner = values
    made = encode(ALL, values)
    read = theirs(ALL).FromString(made)
    assert (read.t, read.n, read.text, read.data, list(read.words)) == (t, n, text, data, words)
    assert struct.pack(f"<{len(read.doubles)}d", *read.doubles) == doubles
    assert struct.pack(f"<{len(read.floats)}f", *read.floats) == floats
    assert [each.n for each in read.inner] == [each[0] for each in inner]
    again = decode(ALL, read.SerializeToString())
    assert again == (t, n, text, data, words or (), doubles, floats, inner or ())
    assert decode(ALL, made) == again


@given(st.binary(max_size=80))
def test_any_bytes_are_a_message_or_a_value_error(data: bytes) -> None:
    try:
        decode(ALL, data)
    except ValueError:
        with pytest.raises(ValueError, match=r"."):
            decode(ALL, data)


@given(values, st.data())
def test_a_message_that_is_cut_is_a_value_error_or_lacks_its_last_fields(
    values: tuple[Any, ...], data: st.DataObject
) -> None:
    made = encode(ALL, values)
    cut = made[: data.draw(st.integers(0, len(made)))]
    try:
        found = decode(ALL, cut)
    except ValueError:
        return
    empty = decode(ALL, b"")
    full = decode(ALL, made)
    for part, none, whole in zip(found, empty, full, strict=True):
        assert part in (none, whole) or list(part) == list(whole)[: len(part)]


@pytest.mark.parametrize("message", [ROWS, SHOWN, PATCHED, LINK])
def test_the_descriptions_of_our_messages_name_their_fields(message: Message) -> None:
    names = [field.name for field in theirs(message).DESCRIPTOR.fields]
    assert sorted(names) == sorted(field.name for field in message.fields)


@pytest.mark.parametrize("number", [-1, 2**64])
def test_a_number_that_64_bits_do_not_hold_is_refused(number: int) -> None:
    with pytest.raises(ValueError, match="no number of 64 bits"):
        encode(ALL, (0.0, number, "", b"", (), b"", b"", ()))


def test_fields_of_a_later_version_are_passed_over() -> None:
    data = theirs(ALL)(n=7).SerializeToString() + bytes([31 << 3 & 0xFF | 0, 1, 5])
    assert decode(ALL, data)[1] == 7
