"""Frames are those of the library, and a stream is cut where its frames end, whatever comes."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from websockets.frames import Frame, Opcode

from cohaptic.protocol.websocket_frames import begins_message, make_frame
from cohaptic_server.shell.wire import (
    ClientStream,
    is_small_binary,
    unmask,
)

pytestmark = pytest.mark.live

HEAD = b"GET / HTTP/1.1\r\nHost: here\r\n\r\n"
LONGEST = 300


def masked(kind: Opcode, data: bytes, fin: bool) -> bytes:
    """A frame of a client."""
    return Frame(kind, data, fin).serialize(mask=True)


payloads = st.binary(max_size=LONGEST)
frames = st.builds(
    masked,
    st.sampled_from((Opcode.TEXT, Opcode.BINARY, Opcode.CONT)),
    payloads,
    st.booleans(),
)


def chunks(data: bytes, cuts: list[int]) -> list[bytes]:
    """The bytes as they may come over a network."""
    places = [0, *sorted(cut % (len(data) + 1) for cut in cuts), len(data)]
    return [data[a:b] for a, b in pairwise(places)]


@given(st.binary(max_size=70_000) | st.text(max_size=200))
def test_a_message_is_framed_as_the_library_does_it(data: bytes | str) -> None:
    kind = Opcode.TEXT if isinstance(data, str) else Opcode.BINARY
    payload = data.encode() if isinstance(data, str) else data
    assert make_frame(data) == Frame(kind, payload).serialize(mask=False)


@pytest.mark.parametrize("size", [0, 125, 126, 65_535, 65_536])
def test_the_length_has_the_field_that_the_library_gives_it(size: int) -> None:
    assert make_frame(bytes(size)) == Frame(Opcode.BINARY, bytes(size)).serialize(mask=False)


@given(st.binary(max_size=125))
def test_what_a_client_masked_is_read(data: bytes) -> None:
    frame = Frame(Opcode.BINARY, data).serialize(mask=True)
    assert is_small_binary(frame)
    assert begins_message(frame)
    assert unmask(frame) == data


@pytest.mark.parametrize(
    "frame",
    [
        Frame(Opcode.TEXT, b"x").serialize(mask=True),
        Frame(Opcode.PING, b"x").serialize(mask=True),
        Frame(Opcode.BINARY, b"x", fin=False).serialize(mask=True),
        Frame(Opcode.BINARY, b"x").serialize(mask=False),
        Frame(Opcode.BINARY, bytes(126)).serialize(mask=True),
        Frame(Opcode.BINARY, b"x").serialize(mask=True) * 2,
        b"",
        b"\x82",
    ],
    ids=["text", "ping", "fragment", "bare", "long", "two", "empty", "cut"],
)
def test_all_else_is_left_to_the_library(frame: bytes) -> None:
    assert not is_small_binary(frame)


@given(st.lists(frames, max_size=8), st.lists(st.integers(0, 4000), max_size=8))
def test_a_stream_is_cut_into_its_frames_however_it_comes(
    sent: list[bytes], cuts: list[int]
) -> None:
    stream = ClientStream(LONGEST)
    found: list[bytes] = []
    head = b""
    for chunk in chunks(HEAD + b"".join(sent), cuts):
        pieces = stream.cut(chunk)
        if not head.endswith(b"\r\n\r\n"):
            head += pieces.pop(0)
        found += pieces
    assert head == HEAD
    assert stream.opened
    assert found == sent


@given(st.binary(max_size=600), st.lists(st.integers(0, 700), max_size=6), st.booleans())
def test_nothing_is_lost_or_kept_of_a_stream_without_sense(
    noise: bytes, cuts: list[int], opened: bool
) -> None:
    """What waits for its rest is less than one frame of the longest payload."""
    stream = ClientStream(LONGEST)
    data = (HEAD if opened else b"") + noise
    passed = b"".join(piece for chunk in chunks(data, cuts) for piece in stream.cut(chunk))
    assert data.startswith(passed)
    assert len(data) - len(passed) < LONGEST + 14


def test_what_is_too_long_or_not_masked_is_passed_on_at_once() -> None:
    long = Frame(Opcode.BINARY, bytes(LONGEST + 1)).serialize(mask=True)
    bare = Frame(Opcode.BINARY, b"x").serialize(mask=False)
    good = Frame(Opcode.BINARY, b"y").serialize(mask=True)
    for bad in (long[:20], bare):
        stream = ClientStream(LONGEST)
        assert stream.cut(HEAD + good + bad) == [HEAD, good, bad]
        assert stream.cut(good[:3]) == [good[:3]]
