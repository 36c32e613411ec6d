from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic_server.guard.proxies import Proxies, network_of
from cohaptic_server.guard.sources import UNKNOWN, Refusal, source_of

PROXIES = Proxies.named(["127.0.0.1", "172.18.0.0/16", "[2001:db8:a::1]", "fd00:7::/32"])
BESIDE = "2001:db8:a::2"  # in the 64 bits of a proxy
FORMS = {
    "192.0.2.7": "192.0.2.7",
    "192.0.2.7:4711": "192.0.2.7",
    '"192.0.2.7:4711"': "192.0.2.7",
    "192.0.2.7:_port": "192.0.2.7",
    "2001:db8:1:2:3::4": "2001:db8:1:2::/64",
    "[2001:db8:1:2:3::4]": "2001:db8:1:2::/64",
    "[2001:DB8:1:2:3::4]:65535": "2001:db8:1:2::/64",
    '"[2001:db8:1:2:3::4]:4711"': "2001:db8:1:2::/64",
    '"[2001:db8:1:2:3::4]"': "2001:db8:1:2::/64",
    "[::ffff:192.0.2.7]:80": "192.0.2.7",
    "unknown": UNKNOWN,
    "_hidden": UNKNOWN,
    "": UNKNOWN,
    "unix:": UNKNOWN,
    "lab.example:80": UNKNOWN,
    "192.0.2.7:": UNKNOWN,
    "192.0.2.7.8": UNKNOWN,
    "192.0.2.7 :80": UNKNOWN,
    "192.0.2.07:80": UNKNOWN,
    "[192.0.2.7": UNKNOWN,
}
own = st.sampled_from(["127.0.0.1", "172.18.255.3:99", '"[2001:db8:a::1]:1"', "[fd00:7::9]"])
# What a stranger may write: rubbish, and what looks like the syntax of either list.
written = st.text('for=;,"\\ []:.129ab%\x00é', max_size=40) | st.sampled_from(
    ['for=9.9.9.9;x="', '", for=9.9.9.9', "for=9.9.9.9, ", '9.9.9.9", "', '\\"', "for=9.9.9.9;x=\\"]
)


@pytest.mark.parametrize(("form", "source"), FORMS.items())
def test_an_address_is_one_in_every_form_that_proxies_write(form: str, source: str) -> None:
    assert PROXIES.visitor("127.0.0.1", [form or ","], []) == source
    element = f"proto=https; For={form} ;by=_here"
    assert PROXIES.visitor("127.0.0.1", [], [element]) == source


@given(written, st.lists(own, max_size=4), st.sampled_from(list(FORMS)[:10]))
def test_the_last_who_is_no_proxy_counts_whatever_a_stranger_has_written_before(
    said: str, passed: list[str], form: str
) -> None:
    entries = [form, *passed]
    assert PROXIES.visitor("127.0.0.1", [said, ", ".join(entries)], []) == FORMS[form]
    pairs = [f'host="{i};for=8.8.8.8, \\"";for={node}' for i, node in enumerate(entries)]
    assert PROXIES.visitor("127.0.0.1", [], [f"{said},{','.join(pairs)}"]) == FORMS[form]


@given(st.lists(written, max_size=12), st.lists(written, max_size=12))
def test_whatever_is_written_the_source_is_short_and_printable(
    for_list: list[str], forwarded: list[str]
) -> None:
    found = PROXIES.visitor("127.0.0.1", for_list, forwarded)
    reported = found.why if isinstance(found, Refusal) else found
    assert reported.isprintable()
    assert len(reported) <= 200
    # It has the rights of no connection of this machine, and is no proxy.
    assert isinstance(found, Refusal) or found not in PROXIES


def test_people_at_addresses_of_proxies_are_each_one_and_apart_from_the_proxies() -> None:
    def who(*entries: str) -> str | Refusal:
        return PROXIES.visitor("127.0.0.1", [", ".join(entries)], [])

    assert who("172.18.0.7", "172.18.0.2") == "proxy 172.18.0.7"
    assert who("172.18.0.8:1", "172.18.0.2") == "proxy 172.18.0.8"
    assert who("unknown", "172.18.0.2") == UNKNOWN
    assert PROXIES.visitor("127.0.0.1", [], []) == "proxy 127.0.0.1"
    assert PROXIES.visitor("127.0.0.1", ["", " "], [""]) == "proxy 127.0.0.1"


def test_a_proxy_is_counted_for_itself_and_the_rest_of_its_network_as_ever() -> None:
    for proxy in ("172.18.0.2", "::ffff:172.18.0.2", "fd00:7::1", "fd00:7::2", "2001:db8:a::1"):
        assert PROXIES.source_of(proxy) in PROXIES
    assert PROXIES.source_of("fd00:7::1") != PROXIES.source_of("fd00:7::2")
    for other in (BESIDE, "172.19.0.1", "::1", "fd00:8::1", "", "no address"):
        assert PROXIES.source_of(other) == source_of(other)
        assert PROXIES.source_of(other) not in PROXIES
    assert "127.0.0.1" not in Proxies()


def test_two_lists_that_agree_count_and_two_that_do_not_are_refused() -> None:
    def both(for_list: str, forwarded: str) -> str | Refusal:
        return PROXIES.visitor("127.0.0.1", [for_list], [forwarded])

    assert both("9.9.9.9, 192.0.2.7:1", 'for="192.0.2.7:2"') == "192.0.2.7"
    for stranger in ("192.0.2.8", "unknown", '"'):
        refused = both("192.0.2.7", f"for={stranger}, for=9.9.9.9")
        assert isinstance(refused, Refusal)
        assert refused.status == 400
    # One who writes nothing that can be read has not said another.
    assert both("192.0.2.7", '"') == "192.0.2.7"


def test_a_network_has_one_way_to_be_written() -> None:
    said = ("127.0.0.1", "127.0.0.1/32", "[::1]", "::ffff:10.0.0.1", "::ffff:10.0.0.0/104", "::/0")
    read = ["127.0.0.1", "127.0.0.1", "::1", "10.0.0.1", "10.0.0.0/8", "::/0"]
    assert [network_of(one) for one in said] == read
