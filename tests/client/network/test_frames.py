"""The stream of a server is cut where its frames end, however it comes; nothing piles up."""

from __future__ import annotations

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st
from websockets.frames import Frame, Opcode

from cohaptic_client.network.wire import LONGEST, Piece, ServerStream

frames = st.builds(
    Frame,
    st.sampled_from((Opcode.TEXT, Opcode.BINARY, Opcode.CONT)),
    st.binary(max_size=300) | st.integers(0, 3 * LONGEST).map(bytes),
    st.booleans(),
) | st.builds(Frame, st.sampled_from((Opcode.PING, Opcode.CLOSE)), st.binary(max_size=125))
cuttings = st.lists(st.integers(0, 20_000), max_size=8)


def chunks(data: bytes, cuts: list[int]) -> list[bytes]:
    """The bytes as they may come over a network."""
    places = [0, *sorted(cut % (len(data) + 1) for cut in cuts), len(data)]
    return [data[a:b] for a, b in pairwise(places)]


def cut(data: bytes, cuts: list[int]) -> list[Piece]:
    stream = ServerStream()
    return [piece for chunk in chunks(data, cuts) for piece in stream.cut(chunk)]


def is_patch(frame: Frame) -> bool:
    """Whether a frame is to pass by the library."""
    return frame.opcode is Opcode.BINARY and frame.fin and len(frame.data) <= LONGEST


@given(st.lists(frames, max_size=8), cuttings)
def test_whole_small_binary_messages_are_found_and_all_else_is_passed_on(
    sent: list[Frame], cuts: list[int]
) -> None:
    data = b"".join(frame.serialize(mask=False) for frame in sent)
    pieces = cut(data, cuts)
    assert b"".join(piece.data for piece in pieces) == data
    assert [p.patch for p in pieces if p.patch is not None] == [
        bytes(frame.data) for frame in sent if is_patch(frame)
    ]
    messages = [frame for frame in sent if frame.opcode in (Opcode.TEXT, Opcode.BINARY)]
    assert sum(piece.begins for piece in pieces) == len(messages)


@given(st.binary(max_size=3 * LONGEST), cuttings)
def test_nothing_is_lost_or_kept_of_a_stream_without_sense(noise: bytes, cuts: list[int]) -> None:
    passed = b"".join(piece.data for piece in cut(noise, cuts))
    assert noise.startswith(passed)
    assert len(noise) - len(passed) < LONGEST + 14


@given(st.integers(0, 2**63 - 1), st.integers(0, 100))
def test_a_length_that_is_claimed_is_not_kept(claimed: int, rest: int) -> None:
    """Of a long frame all that comes is passed on at once."""
    head = bytes((0x82, 127)) + claimed.to_bytes(8, "big")
    stream = ServerStream()
    pieces = stream.cut(head + bytes(rest))
    kept = 10 + rest - sum(len(piece.data) for piece in pieces)
    assert kept <= (LONGEST + 10 if claimed <= LONGEST else 0)
    assert not any(piece.patch for piece in pieces) or claimed <= rest


@given(st.binary(max_size=125), st.binary(min_size=4, max_size=4))
def test_a_masked_frame_is_left_to_the_library_which_refuses_it(data: bytes, key: bytes) -> None:
    frame = bytes((0x82, 0x80 | len(data))) + key + data
    assert ServerStream().cut(frame) == [Piece(frame, None, begins=True)]
