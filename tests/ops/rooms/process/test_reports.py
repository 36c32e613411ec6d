from __future__ import annotations

import contextlib

from hypothesis import given
from hypothesis import strategies as st

from cohaptic_ops.monitoring.json_lines import BadLine
from cohaptic_ops.rooms.process.reports import (
    Allow,
    Failed,
    Left,
    Line,
    Ready,
    Report,
    Stop,
    decode,
    encode,
)

COUNTS = st.integers(0, 2**40)
LINES = st.one_of(
    st.just(Ready()),
    st.just(Stop()),
    st.builds(Failed, why=st.text(max_size=200)),
    st.builds(Left, numbers=st.lists(COUNTS, max_size=20)),
    st.builds(Report, **dict.fromkeys(set(Report.model_fields) - {"kind"}, COUNTS)),
    st.builds(Allow, **dict.fromkeys(set(Allow.model_fields) - {"kind"}, COUNTS)),
)


@given(LINES)
def test_a_line_comes_back_as_it_was_and_is_one(line: Line) -> None:
    data = encode(line)
    assert data.count(b"\n") == 1
    assert data.endswith(b"\n")
    assert decode(data[:-1]) == line


@given(st.binary(max_size=200))
def test_any_bytes_are_a_line_or_none(data: bytes) -> None:
    with contextlib.suppress(BadLine):
        assert decode(encode(decode(data)).strip()) == decode(data)
