from __future__ import annotations

import pytest

from cohaptic_server.http.reachable import addresses_for_others, hosts_for_others

FOUND = ("192.168.1.7", "127.0.0.1", "fe80::1", "fd00::5", "10.0.0.2", "0.0.0.0", "rubbish")


@pytest.mark.parametrize(
    ("host", "hosts"),
    [
        ("0.0.0.0", ("192.168.1.7", "10.0.0.2")),
        ("::", ("[fd00::5]",)),
        ("[::]", ("[fd00::5]",)),
        ("", ("192.168.1.7", "10.0.0.2", "[fd00::5]")),
    ],
)
def test_who_listens_everywhere_is_reached_by_the_machines_addresses(
    host: str, hosts: tuple[str, ...]
) -> None:
    assert hosts_for_others(host, (), FOUND) == hosts
    assert hosts_for_others(host, (), ("127.0.0.1", "::1")) == ()


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", "::1", "[::1]", "127.3.4.5"])
def test_what_only_this_machine_reaches_is_offered_to_nobody(host: str) -> None:
    assert hosts_for_others(host, ("lab.example",), FOUND) == ()


def test_addresses_keep_scheme_and_port() -> None:
    hosts = ("192.168.1.7", "[fd00::5]")
    assert addresses_for_others("ws://0.0.0.0:8765", hosts) == (
        "ws://192.168.1.7:8765",
        "ws://[fd00::5]:8765",
    )
    assert addresses_for_others("wss://[::]:443", hosts)[0] == "wss://192.168.1.7:443"
