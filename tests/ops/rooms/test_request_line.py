from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic_ops.rooms.router import LARGEST, target_of

TARGETS = st.text(st.characters(min_codepoint=0x21, max_codepoint=0x7E), min_size=1, max_size=300)
METHODS = st.sampled_from(["GET", "HEAD", "POST", "OPTIONS"])


@given(METHODS, TARGETS, st.binary(max_size=200))
def test_the_target_of_a_request_is_found_whatever_follows(
    method: str, target: str, rest: bytes
) -> None:
    assert target_of(f"{method} {target} HTTP/1.1\r\n".encode() + rest) == target


@given(METHODS, TARGETS, st.data())
def test_every_part_of_a_request_line_waits_for_the_rest(
    method: str, target: str, data: st.DataObject
) -> None:
    line = f"{method} {target} HTTP/1.1\r\n".encode()
    assert target_of(line[: data.draw(st.integers(0, len(line) - 1))]) is None


@given(st.binary(min_size=LARGEST))
def test_nothing_waits_beyond_the_longest_line(seen: bytes) -> None:
    assert target_of(seen) is not None


@pytest.mark.parametrize(
    "seen",
    [
        b"\x16\x03\x01\x02\x00\x01",  # TLS
        b"get / HTTP/1.1\r\n",
        b"GET  / HTTP/1.1\r\n",
        b"GET / HTTP/2\r\n",
        b"GET /\r\n",
        b"\r\n",
        b"GET /\xff HTTP/1.1\r\n",
        b"GET /" + b"x" * LARGEST,
    ],
)
def test_what_is_no_request_is_no_rooms(seen: bytes) -> None:
    assert target_of(seen) == ""
