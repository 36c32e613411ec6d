# ruff: noqa: RUF001
from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.errors import CloseCode, RemoteProtocolError
from cohaptic.protocol.control.message import SetName
from cohaptic.protocol.messages import Hello, encode_control
from cohaptic_server.access.admission import Guest
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.room.member import Muted
from cohaptic_server.room.moderation import Removed
from cohaptic_server.room.seats.names import Claim, KeptNames, looks_like, skeleton
from tests.server.peers import hello
from tests.server.room.seats.test_waiting import failed, full, wait
from tests.server.room.test_session_host import connect, join, news, say, session_host

ALIKE = ("аnn", "ａｎｎ", "a nn", "ɑnn", "αnn", "аｎn")
PAIRS = (
    ("Il1|", "llll"),
    ("user0", "userO"),
    ("Cyrus", "Сyrus"),
    ("o'neil", "o’neil"),
    ("a-b", "a–b"),
)


@pytest.mark.parametrize("other", ALIKE)
def test_what_looks_like_a_name_is_told(other: str) -> None:
    assert other != "ann"
    assert looks_like("ann", other)


@pytest.mark.parametrize(("one", "other"), PAIRS)
def test_signs_that_look_like_letters_are_told(one: str, other: str) -> None:
    assert looks_like(one, other)


@pytest.mark.parametrize(
    "other", ["Ann", "ánn", "anna", "bob", "an", "анна", "user1", "<b>ann</b>"]
)
def test_what_can_be_told_apart_is_another_name(other: str) -> None:
    assert not looks_like("ann", other)


@given(st.text(max_size=32))
def test_a_name_looks_like_itself_and_like_its_skeleton(name: str) -> None:
    assert looks_like(name, name)
    assert skeleton(skeleton(name)) == skeleton(name)


@pytest.mark.parametrize("other", ALIKE)
def test_a_name_that_looks_like_anothers_is_taken_wherever_that_one_is(
    small_balloon: Balloon, other: str
) -> None:
    there = session_host(small_balloon)
    join(there, "ann")
    assert failed(join(there, other))[0] == CloseCode.NAME_TAKEN.value
    # By changing its name nobody gets it either.
    bob = join(there, "bob")
    say(there, bob, encode_control(SetName(name=other)))
    assert "ann is taken" in news(bob)[-1].reason
    # Nor where it waits, or was a moment ago.
    before, _ = full(small_balloon)
    wait(before, "ann", key="a" * 16)
    assert failed(wait(before, other, key="b" * 16))[0] == CloseCode.NAME_TAKEN.value
    kept = KeptNames()
    kept.keep("ann", Claim(None, "home"), 0.0, since=None)
    with pytest.raises(RemoteProtocolError):
        kept.check(other, Claim(None, "elsewhere"), 1.0)


def test_who_has_the_key_of_a_name_changes_how_it_is_written(small_balloon: Balloon) -> None:
    there = session_host(small_balloon)
    ann = join(there, "аnn")
    say(there, ann, encode_control(SetName(name="ann")))
    assert news(ann)[-1].reason == ""


@pytest.mark.parametrize("other", ALIKE)
def test_who_was_put_out_or_muted_is_so_by_what_looks_like_its_name(other: str) -> None:
    removed, muted = Removed(), Muted()
    removed.add(Guest(session="one"), "ann", "home", 0.0, 1e9, ban=True)
    with pytest.raises(RemoteProtocolError, match="banned"):
        removed.check(Guest(session="two"), other, "elsewhere", 1.0)
    muted.add("ann", Claim(None, "home"))
    assert muted.holds(other, Claim(None, "elsewhere"))


def test_a_name_is_told_as_it_was_taken(small_balloon: Balloon) -> None:
    there = session_host(small_balloon)
    peer = connect(there)
    text = encode_control(hello("ann")).replace('"ann"', '" \\u00a0ａｎｎ "')
    (line,) = say(there, peer, text).log
    assert line.user == "ann"
    (welcome,) = news(peer)
    assert welcome.name == "ann"
    assert Hello(protocol=5, name=" ann ").name == "ann"
