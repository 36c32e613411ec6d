from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic_server.http.origins import LOOPBACK, may_connect, may_upload


@pytest.mark.parametrize(
    ("origin", "host", "listens_on", "may"),
    [
        (None, "anything", "127.0.0.1", True),
        ("http://localhost:5173", "localhost:8765", "127.0.0.1", True),
        ("http://[::1]:80", None, "::1", True),
        ("http://lab.example:8765", "lab.example:8765", "0.0.0.0", True),
        ("https://lab.example", "LAB.example", "0.0.0.0", True),
        ("http://LAB.example:8765", "lab.example:8765", "192.0.2.7", True),
        ("http://192.0.2.7:8765", "192.0.2.7:8765", "0.0.0.0", True),
        ("http://lab.example:8765", "lab.example:8766", "0.0.0.0", False),
        ("http://elsewhere.example", "lab.example", "0.0.0.0", False),
        ("ftp://lab.example", "lab.example", "0.0.0.0", False),
        ("http://x@lab.example", "lab.example", "0.0.0.0", False),
        ("http://lab.example.elsewhere.example", "lab.example", "0.0.0.0", False),
        ("http://localhost.elsewhere.example", "localhost", "0.0.0.0", False),
        ("null", "null", "0.0.0.0", False),
        ("", "", "0.0.0.0", False),
        ("http://lab.example", None, "0.0.0.0", False),
        # A name of a stranger's that points to this machine.
        ("http://rebound.example:8765", "rebound.example:8765", "127.0.0.1", False),
        ("https://proxy.example", "localhost:8765", "127.0.0.1", True),
        ("https://proxy.example", "proxy.example", "127.0.0.1", True),
        ("https://proxy.example:1", "proxy.example", "127.0.0.1", False),
    ],
)
def test_the_own_page_may_and_others_may_not(
    origin: str | None, host: str | None, listens_on: str, may: bool
) -> None:
    allowed = ("https://proxy.example",)
    assert may_connect(origin, host, listens_on=listens_on, allowed=allowed) == may


@given(st.text(max_size=40), st.none() | st.text(max_size=40), st.sampled_from(LOOPBACK))
def test_on_this_machine_alone_the_host_says_nothing(
    origin: str, host: str | None, listens_on: str
) -> None:
    if not origin.startswith(("http://localhost", "https://localhost", "http://127", "http://[")):
        assert not may_connect(origin, host, listens_on=listens_on, allowed=())


@pytest.mark.parametrize(
    ("origin", "host", "peer", "may"),
    [
        (None, "127.0.0.1:8765", "127.0.0.1", True),
        ("http://localhost:8765", "localhost:8765", "::1", True),
        ("http://LOCALHOST:9000", "localhost:9000", "127.0.0.1", True),
        ("http://[::1]:8765", "[::1]:8765", "::ffff:127.0.0.1", True),
        ("https://proxy.example", "proxy.example", "127.0.0.1", True),
        # From another machine, whatever it says.
        (None, "127.0.0.1:8765", "192.0.2.7", False),
        ("http://localhost:8765", "localhost:8765", "::ffff:192.0.2.7", False),
        ("https://proxy.example", "proxy.example", "192.0.2.7", False),
        (None, "localhost", None, False),
        (None, "localhost", "nonsense", False),
        # Another page of this machine, and a name that was made to point at it.
        ("http://localhost:5173", "localhost:8765", "127.0.0.1", False),
        ("http://127.0.0.1:8765", "localhost:8765", "127.0.0.1", False),
        ("http://rebound.example:8765", "rebound.example:8765", "127.0.0.1", False),
        (None, "rebound.example:8765", "127.0.0.1", False),
        ("null", "localhost:8765", "127.0.0.1", False),
        ("", "", "127.0.0.1", False),
        (None, None, "127.0.0.1", False),
    ],
)
def test_only_the_own_page_on_this_machine_may_bring_a_file(
    origin: str | None, host: str | None, peer: str | None, may: bool
) -> None:
    allowed = ("https://proxy.example",)
    assert may_upload(origin, host, peer, allowed=allowed) == may
