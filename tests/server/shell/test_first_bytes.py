"""What is enough to be served: laws over all ways to cut what a client sends."""

from __future__ import annotations

import ssl

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic_server.shell.acceptor import LARGEST, has_asked
from tests.server.shell.stage import REQUEST

pytestmark = pytest.mark.live


def hello() -> bytes:
    """What a client of TLS says first."""
    sent = ssl.MemoryBIO()
    client = ssl.create_default_context().wrap_bio(ssl.MemoryBIO(), sent, server_hostname="here")
    with pytest.raises(ssl.SSLWantReadError):
        client.do_handshake()
    return sent.read()


@pytest.mark.parametrize(("said", "tls"), [(REQUEST, False), (hello(), True)])
def test_only_a_whole_request_or_hello_asks_for_something(said: bytes, tls: bool) -> None:
    assert [has_asked(said[:n], tls=tls) for n in range(1, len(said))] == [False] * (len(said) - 1)
    assert has_asked(said, tls=tls)
    assert has_asked(said + b"more", tls=tls)


@given(st.binary(min_size=1, max_size=200), st.booleans())
def test_what_is_no_beginning_is_passed_on_to_be_judged(said: bytes, tls: bool) -> None:
    if tls:
        assert has_asked(said, tls=True) or said[:1] == b"\x16"
    else:
        assert has_asked(said, tls=False) or said[:1].isalpha()


@given(st.binary(min_size=LARGEST, max_size=LARGEST), st.booleans())
def test_of_what_is_long_the_rest_is_not_waited_for(said: bytes, tls: bool) -> None:
    assert has_asked(said, tls=tls)


@given(st.binary(min_size=1, max_size=300), st.binary(max_size=300), st.booleans())
def test_more_bytes_take_nothing_back(said: bytes, more: bytes, tls: bool) -> None:
    assert has_asked(said + more, tls=tls) or not has_asked(said, tls=tls)
