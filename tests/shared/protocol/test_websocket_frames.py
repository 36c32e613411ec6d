"""Frames of both ends are those of the library."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from websockets.frames import Frame, Opcode

from cohaptic.protocol.websocket_frames import KEY, Head, make_frame, mask, read_head

messages = st.binary(max_size=70_000) | st.text(max_size=200)
keys = st.binary(min_size=KEY, max_size=KEY)


@given(messages, keys)
def test_a_masked_frame_says_what_was_masked(message: bytes | str, key: bytes) -> None:
    kind, payload = (
        (Opcode.TEXT, message.encode()) if isinstance(message, str) else (Opcode.BINARY, message)
    )
    bare = Frame(kind, payload).serialize(mask=False)
    frame = make_frame(message, key)
    head = read_head(frame, 0)
    assert head is not None
    assert head == Head(len(frame) - len(payload), len(payload), masked=True)
    assert frame[head.size - KEY : head.size] == key
    # The same frame but for the mask bit, the key and the mask.
    plain = bytes((frame[0], frame[1] & 0x7F)) + frame[2 : head.size - KEY]
    assert plain + mask(frame[head.size :], key) == bare == make_frame(message)


@given(messages)
def test_a_header_is_read_once_all_of_it_is_there(message: bytes | str) -> None:
    frame = make_frame(message)
    head = read_head(frame, 0)
    assert head is not None
    assert head.size + head.payload == len(frame)
    assert all(read_head(frame[:size], 0) is None for size in range(head.size))
    assert read_head(b"x" + frame, 1) == head


@pytest.mark.parametrize("size", [0, 125, 126, 65_535, 65_536])
def test_the_length_has_the_field_that_the_library_gives_it(size: int) -> None:
    masked = Frame(Opcode.BINARY, bytes(size)).serialize(mask=True)
    assert len(make_frame(bytes(size), b"1234")) == len(masked)
    assert make_frame(bytes(size), b"1234")[:2] == masked[:2]
