from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.errors import LocalProtocolError, RemoteProtocolError
from cohaptic.protocol.ack import SIZE, Ack
from cohaptic.protocol.version import PROTOCOL_VERSION
from tests.strategies import acks


@given(acks)
def test_comes_back_as_it_was(ack: Ack) -> None:
    assert len(ack.encode()) == SIZE
    assert Ack.decode(ack.encode()) == ack


@given(
    st.binary(max_size=20)
    | st.binary(min_size=8, max_size=8).map(lambda b: bytes([PROTOCOL_VERSION, 5, 0, 0]) + b)
)
def test_any_bytes_give_an_ack_or_the_peers_error(data: bytes) -> None:
    try:
        assert Ack.decode(data).tick >= 1
    except RemoteProtocolError:
        pass


@pytest.mark.parametrize(
    ("frame", "message"),
    [
        (b"", "frame length is 0"),
        (bytes([PROTOCOL_VERSION, 1, 0, 0]) + bytes(8), "frame kind is 1; expected 5"),
        (Ack(1).encode()[:-1], "ack length is 11; expected 12 bytes"),
        (Ack(1).encode() + b"x", "ack length is 13; expected 12 bytes"),
        (bytes([PROTOCOL_VERSION, 5, 0, 0]) + bytes(8), "tick of an ack is 0"),
        (bytes([PROTOCOL_VERSION, 5, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0]), "wants of an ack is 2"),
    ],
)
def test_rubbish_is_named(frame: bytes, message: str) -> None:
    with pytest.raises(RemoteProtocolError, match=message):
        Ack.decode(frame)


@pytest.mark.parametrize("ack", [Ack(0), Ack(2**32), Ack(1, wants=2)])
def test_a_value_out_of_its_limits_is_a_local_error(ack: Ack) -> None:
    with pytest.raises(LocalProtocolError):
        ack.encode()
