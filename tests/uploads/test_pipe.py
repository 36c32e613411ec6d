from __future__ import annotations

import io

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic_uploads.pipe import DATA, MAX_MESSAGE, PipeEnded, fields_of, receive, send


@given(st.lists(st.binary(max_size=100)))
def test_messages_come_as_they_were_sent(messages: list[bytes]) -> None:
    stream = io.BytesIO()
    for message in messages:
        send(stream, DATA, message)
    stream.seek(0)
    assert [receive(stream) for _ in messages] == [(DATA, message) for message in messages]
    with pytest.raises(PipeEnded):
        receive(stream)


@given(st.binary(max_size=60))
def test_any_bytes_are_a_message_or_the_end(data: bytes) -> None:
    try:
        kind, content = receive(io.BytesIO(data))
    except PipeEnded:
        return
    assert data.startswith(kind)
    assert content in data


def test_a_message_that_says_it_is_huge_is_not_waited_for() -> None:
    with pytest.raises(PipeEnded, match="no message"):
        receive(io.BytesIO(b"D" + (MAX_MESSAGE + 1).to_bytes(4, "little") + bytes(9)))


@given(st.binary(max_size=60) | st.just(b"[" * 100_000))
def test_any_bytes_have_names_or_none(data: bytes) -> None:
    try:
        fields = fields_of(data)
    except PipeEnded:
        return
    assert all(isinstance(name, str) for name in fields)
