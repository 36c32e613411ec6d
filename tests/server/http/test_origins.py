from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic_server.http.reachable import is_of_this_machine, is_own_host, may_connect


@pytest.mark.parametrize(
    ("origin", "host", "own", "may"),
    [
        (None, "anything", "127.0.0.1", True),
        ("http://localhost:5173", "localhost:8765", "127.0.0.1", True),
        ("http://[::1]:80", None, "::1", True),
        ("http://lab.example:8765", "lab.example:8765", "192.0.2.7", True),
        ("https://lab.example", "LAB.example", "192.0.2.7", True),
        ("http://LAB.example:8765", "lab.example:8765", None, True),
        ("http://192.0.2.7:8765", "192.0.2.7:8765", "192.0.2.7", True),
        ("http://192.0.2.7:8765", "192.0.2.7:8765", "::ffff:192.0.2.7", True),
        ("http://[2001:db8::7]:8765", "[2001:db8:0::7]:8765", "2001:db8::7", False),
        ("http://[2001:db8::7]:8765", "[2001:db8::7]:8765", "2001:db8::7", True),
        ("http://192.0.2.8:8765", "192.0.2.8:8765", "192.0.2.7", False),
        ("http://lab.example:8765", "lab.example:8766", "192.0.2.7", False),
        ("http://elsewhere.example", "lab.example", "192.0.2.7", False),
        ("ftp://lab.example", "lab.example", "192.0.2.7", False),
        ("http://x@lab.example", "lab.example", "192.0.2.7", False),
        ("http://lab.example.elsewhere.example", "lab.example", "192.0.2.7", False),
        ("http://localhost.elsewhere.example", "localhost", "192.0.2.7", False),
        ("null", "null", "192.0.2.7", False),
        ("", "", "192.0.2.7", False),
        ("http://lab.example", None, "192.0.2.7", False),
        # A name of a stranger's that points to this machine, also within a closed network.
        ("http://rebound.example:8765", "rebound.example:8765", "127.0.0.1", False),
        ("http://rebound.example:8765", "rebound.example:8765", "192.0.2.7", False),
        ("http://lab.example.rebound.example", "lab.example.rebound.example", "192.0.2.7", False),
        ("https://proxy.example", "localhost:8765", "127.0.0.1", True),
        ("https://proxy.example", "proxy.example", "127.0.0.1", True),
        ("https://proxy.example:1", "proxy.example", "127.0.0.1", False),
    ],
)
def test_the_own_page_may_and_others_may_not(
    origin: str | None, host: str | None, own: str | None, may: bool
) -> None:
    allowed, hosts = ("https://proxy.example",), ("Lab.example",)
    assert may_connect(origin, host, own=own, hosts=hosts, allowed=allowed) == may


names = st.text(max_size=40) | st.from_regex(r"[a-z.:\[\]0-9-]{1,40}", fullmatch=True)


@given(names, st.sampled_from(["127.0.0.1", "192.0.2.7", "2001:db8::7", None]))
def test_no_name_but_the_servers_own_makes_a_page_its_own(name: str, own: str | None) -> None:
    host = name.lower().rpartition(":")[0] if name.rpartition(":")[2].isdigit() else name.lower()
    if host.strip("[]") in ("localhost", "127.0.0.1", "::1", own):
        return
    assert not is_own_host(name, own, ())
    assert not may_connect(f"http://{name}", name, own=own, hosts=(), allowed=())


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
    assert is_of_this_machine(origin, host, peer, allowed=allowed) == may


@pytest.mark.parametrize("allowed", [".Lab.example", "*.lab.example"])
@pytest.mark.parametrize(
    ("host", "own"),
    [
        ("a.lab.example", True),
        ("b.A.LAB.example:8765", True),
        ("lab.example", False),
        ("evil-lab.example", False),
        ("a.lab.example.elsewhere.example", False),
        (".lab.example", False),
    ],
)
def test_a_leading_dot_stands_for_all_names_below(allowed: str, host: str, own: bool) -> None:
    assert is_own_host(host, "192.0.2.7", (allowed,)) == own
    assert may_connect(f"http://{host}", host, own="192.0.2.7", hosts=(allowed,), allowed=()) == own
