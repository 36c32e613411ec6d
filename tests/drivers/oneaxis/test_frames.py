from __future__ import annotations

import struct

from hypothesis import given
from hypothesis import strategies as st

from cohaptic_drivers.oneaxis.frames import Reader, Report, command, crc16


def report(sequence: int, counts: int, time: int = 5, flags: int = 0) -> bytes:
    body = struct.pack("<BBBIih", ord("R"), sequence, flags, time, counts, -100)
    return b"\xc5" + body + crc16(body).to_bytes(2, "little")


@given(st.floats(allow_nan=True, allow_infinity=True))
def test_a_current_that_cannot_be_is_none_or_the_most(amperes: float) -> None:
    (reported,) = struct.unpack("<h", command(0, amperes)[3:5])
    wanted = 1e3 * amperes if abs(amperes) < 1e6 else 32767.0 if amperes > 0.0 else -32767.0
    limit = max(-32767.0, min(32767.0, wanted))
    assert reported == (round(limit) if abs(amperes) < float("inf") else 0)


@given(
    st.lists(
        st.tuples(st.binary(max_size=30), st.integers(0, 255), st.integers(-(2**31), 2**31 - 1))
    ),
    st.integers(1, 40),
)
def test_frames_are_found_among_anything_however_it_is_cut(
    parts: list[tuple[bytes, int, int]], size: int
) -> None:
    """A byte of noise may look like the beginning of a frame, and then hides none that is true."""
    reader = Reader()
    stream = b"".join(noise + report(sequence, counts) for noise, sequence, counts in parts)
    stream += bytes(24)
    found = [
        each for k in range(0, len(stream), size) for each in reader.take(stream[k : k + size])
    ]
    reported = [(each.sequence, each.counts) for each in found if isinstance(each, Report)]
    wanted = [(sequence, counts) for _, sequence, counts in parts]
    left = iter(reported)
    assert all(each in left for each in wanted)


@given(st.integers(0, 15), st.integers(1, 255))
def test_a_changed_byte_is_found(at: int, change: int) -> None:
    frame = bytearray(report(1, 77))
    frame[at] ^= change
    reader = Reader()
    assert reader.take(bytes(frame) + bytes(24)) == []
    assert reader.skipped > 0
