from __future__ import annotations

from collections import Counter

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.errors import CloseCode, RemoteProtocolError
from cohaptic_server.guard.limits import Budget, Limits
from cohaptic_server.guard.sources import UNKNOWN, Sources, source_of

FEW = Limits(
    connections=Budget(1.0, 5.0), joins=Budget(1.0, 2.0), dismissals=Budget(0.5, 2.0), open=3,
    open_in_all=4, unread=1000, unread_in_all=1500,
)  # fmt: skip


@pytest.mark.parametrize(
    ("host", "source"),
    [
        ("192.0.2.7", "192.0.2.7"),
        ("::ffff:192.0.2.7", "192.0.2.7"),
        ("2001:db8:1:2:3:4:5:6", "2001:db8:1:2::/64"),
        ("fe80::1%eth0", "fe80::/64"),
        ("::1", "::1"),
        ("", UNKNOWN),
        ("a socket\x1b[2J", UNKNOWN),
    ],
)
def test_a_source_is_an_address_or_the_network_of_one_subscriber(host: str, source: str) -> None:
    assert source_of(host) == source


@given(st.text(max_size=60))
def test_whatever_a_peer_is_called_its_source_is_short_and_printable(host: str) -> None:
    source = source_of(host)
    assert source.isprintable()
    assert len(source) <= 45


steps = st.lists(
    st.tuples(
        st.sampled_from("abc"),
        st.sampled_from(["enter", "leave", "dismiss", "respond", "taken"]),
        st.floats(0.0, 2.0),
    ),
    max_size=80,
)


@given(steps)
def test_counts_are_those_of_who_is_there_and_never_above_their_limits(
    happenings: list[tuple[str, str, float]],
) -> None:
    sources, now = Sources(FEW), 0.0
    inside: Counter[str] = Counter()
    unread: Counter[str] = Counter()
    for source, what, pause in happenings:
        now += pause
        if what == "enter":
            inside[source] += sources.enter(source, now) is None
        elif what == "leave" and inside[source]:
            sources.leave(source)
            inside[source] -= 1
        elif what == "dismiss":
            sources.dismiss(source, now)
        elif what == "respond":
            unread[source] += 400 * (sources.respond(source, 400, now) is None)
        elif unread[source]:
            sources.taken(source, 400)
            unread[source] -= 400
        assert sources.open == inside.total() <= FEW.open_in_all
        assert sources.unread == unread.total() <= FEW.unread_in_all
        assert max(inside.values(), default=0) <= FEW.open
        assert max(unread.values(), default=0) <= FEW.unread


def test_who_is_refused_hears_value_and_limit_and_when_to_come_again() -> None:
    sources = Sources(FEW)
    for _ in range(5):
        assert sources.enter("a", 0.0) is None
        sources.leave("a")
    refused = sources.enter("a", 0.0)
    assert refused is not None
    assert "from a: at most 1 a second and 5 at once" in refused.why
    assert sources.enter("b", 0.0) is None
    assert sources.enter("a", refused.retry + 1e-6) is None


def test_an_address_whose_connections_ask_for_too_much_has_to_wait_and_others_need_not() -> None:
    sources = Sources(FEW)
    assert sources.enter("a", 0.0) is None
    for _ in range(100):
        sources.dismiss("a", 0.0)
    refused = sources.enter("a", 0.0)
    assert refused is not None
    assert refused.retry == pytest.approx(2.0)
    assert sources.enter("b", 0.0) is None
    assert sources.enter("a", 2.001) is None


def test_one_response_is_served_whatever_its_size() -> None:
    sources = Sources(FEW)
    assert sources.respond("a", 10**9, 0.0) is None
    assert sources.respond("a", 1, 0.0) is not None
    sources.taken("a", 10**9)
    assert sources.respond("a", 1, 0.0) is None


def test_too_many_joins_are_told_with_their_budget() -> None:
    sources = Sources(FEW)
    sources.join("a", 0.0)
    sources.join("a", 0.0)
    with pytest.raises(RemoteProtocolError, match="at most 1 a second and 2 at once") as caught:
        sources.join("a", 0.0)
    assert caught.value.code is CloseCode.TOO_MANY
    sources.join("b", 0.0)


def test_control_messages_of_all_connections_of_an_address_count_together() -> None:
    sources = Sources(Limits(texts_in_all=Budget(1.0, 5.0)))
    assert sources.say("a", 3, 0.0) is None
    error = sources.say("a", 3, 0.0)
    assert error is not None
    assert "control messages from one address is 'too many: 3 more'; expected at most 1" in str(
        error
    )
    assert sources.say("b", 3, 0.0) is None
    assert sources.say("a", 3, 1.0) is None


def test_a_million_addresses_are_not_remembered_and_those_inside_are() -> None:
    sources = Sources(FEW)
    assert sources.enter("inside", 0.0) is None
    for number in range(20_000):
        sources.dismiss(f"{number}", 0.0)
    assert len(sources) <= 4096
    sources.leave("inside")
    assert sources.open == 0
