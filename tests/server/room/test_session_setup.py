"""Tokens at the room admission of a room: who touches, who watches, who comes back."""

from __future__ import annotations

from typing import Any

import pytest

from cohaptic.errors import CloseCode
from cohaptic.protocol.messages import (
    Come,
    Error,
    Hello,
    Place,
    UserJoined,
    UserLeft,
    Welcome,
    decode_server_control,
    encode_control,
)
from cohaptic.protocol.version import PROTOCOL_VERSION, SUBPROTOCOL
from cohaptic.protocol.watch_messages import SetLatency, Watch, Watching, decode_watch_control
from cohaptic_server.access.admission import Admission
from cohaptic_server.access.keys import Grants, KeyRing
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.guard.limits import Budget, Limits
from cohaptic_server.guard.sources import Sources
from cohaptic_server.room.peer import Peer
from cohaptic_server.room.room import Room
from cohaptic_server.room.session_host import SessionHost
from cohaptic_server.room.session_setup import MAX_PAGES, RoomAdmission
from cohaptic_server.room.watch.scene_broadcast import SceneBroadcast
from cohaptic_server.settings import ServerSettings
from cohaptic_server.world.state import Touch
from tests.server.access.some import ALL, NOW, OTHER, RING, admission, token
from tests.server.peers import sample


def session_host(body: Balloon, acceptor: Admission | None = None, **settings: Any) -> SessionHost:
    room = Room(body, ServerSettings(**settings))
    limits = Limits(joins=Budget(1.0, 5.0))
    room_admission = RoomAdmission(Sources(limits), admission() if acceptor is None else acceptor)
    return SessionHost(room, SceneBroadcast(room, model=None), room_admission)


def say(
    there: SessionHost,
    said: Hello | Come | Watch | SetLatency,
    peer: Peer | None = None,
    source: str = "",
) -> Peer:
    """What somebody says first, or next."""
    if peer is None:
        peer = there.connect(0.0, SUBPROTOCOL, SUBPROTOCOL, source)
    there.receive(peer, encode_control(said), 0.0, NOW)
    return peer


def hello(name: str = "left", **said: Any) -> Hello:
    return Hello(protocol=PROTOCOL_VERSION, name=name, **said)


def watch(**said: Any) -> Watch:
    return Watch(protocol=PROTOCOL_VERSION, **said)


def welcome(peer: Peer) -> Welcome:
    message = decode_server_control(str(peer.session.take(clear=True)[0]))
    assert isinstance(message, Welcome)
    return message


def place(peer: Peer) -> Place:
    (message,) = [decode_server_control(str(data)) for data in peer.session.take(clear=True)]
    assert isinstance(message, Place)
    return message


def watching(peer: Peer) -> Watching:
    message = decode_watch_control(str(peer.session.take(clear=True)[0]))
    assert isinstance(message, Watching)
    return message


def refused(peer: Peer, code: CloseCode) -> str:
    """The words with which somebody was refused, in the error and in the close."""
    message = decode_server_control(str(peer.session.take(clear=True)[-1]))
    assert isinstance(message, Error)
    assert peer.session.close is not None
    assert message.code == code.value == peer.session.close[0]
    return message.message


def test_who_has_an_invitation_touches_and_gets_a_session(small_balloon: Balloon) -> None:
    there = session_host(small_balloon)
    peer = say(there, hello(token=token()))
    session = welcome(peer).session
    assert session is not None
    assert peer.guest.sub == "anna"
    assert session not in repr(peer)


@pytest.mark.parametrize("first", [hello(), watch(), hello(token="rubbish"), watch(token="x.y.z")])
def test_who_has_none_gets_nothing_and_hears_what_to_do(
    small_balloon: Balloon, first: Hello | Watch
) -> None:
    there = session_host(small_balloon)
    assert ": " in refused(say(there, first), CloseCode.UNAUTHENTICATED)
    assert not there.room.members
    assert not there.scene_broadcast.watchers


def test_who_may_not_touch_may_watch(small_balloon: Balloon) -> None:
    there = session_host(small_balloon)
    only = token(Grants(room="main", room_join=True, can_view=True))
    assert "you may watch" in refused(say(there, hello(token=only)), CloseCode.FORBIDDEN)
    peer = say(there, watch(token=only))
    heard = watching(peer)
    assert not heard.can_touch
    assert not heard.room_admin
    assert heard.session is not None


def test_who_may_touch_alone_does_not_watch(small_balloon: Balloon) -> None:
    there = session_host(small_balloon)
    only = token(Grants(room="main", room_join=True, can_touch=True))
    assert "canView" in refused(say(there, watch(token=only)), CloseCode.FORBIDDEN)
    welcome(say(there, hello(token=only)))


def test_of_a_users_force_the_body_gets_what_the_token_grants(small_balloon: Balloon) -> None:
    there = session_host(small_balloon)
    for name, limit, device, expected in [
        ("soft", 2.0, 10.0, 2.0),
        ("weak", 5.0, 1.0, 1.0),
        ("free", None, 10.0, 10.0),
        ("none", 0.0, 10.0, 0.0),
    ]:
        some = token(ALL.model_copy(update={"max_force": limit}))
        peer = say(there, hello(name, max_force=device, token=some))
        there.receive(peer, sample(1).encode(), 0.0, NOW)
        assert peer.user is not None
        touch = there.room.members[peer.user].touch
        assert isinstance(touch, Touch)
        assert touch.who.max_force == expected
    for k in range(1, 60):
        there.tick(k / 60.0)
        for name, limit in [("soft", 2.0), ("weak", 1.0), ("none", 0.0)]:
            number = next(n for n, m in there.room.members.items() if m.hello.name == name)
            assert there.room.world.users[number].force <= limit + 1e-9


@pytest.mark.parametrize("granted", [True, False])
@pytest.mark.parametrize("allowed", [True, False])
def test_latency_takes_the_owners_option_and_the_grant(
    small_balloon: Balloon, granted: bool, allowed: bool
) -> None:
    there = session_host(small_balloon, allow_latency=allowed)
    some = token(ALL.model_copy(update={"can_inject_latency": granted}))
    peer = say(there, watch(token=some))
    assert watching(peer).allow_latency == (granted and allowed)
    say(there, SetLatency(user=1, delay=0.1), peer)
    if not allowed:
        assert "--allow-latency" in refused(peer, CloseCode.BAD_MESSAGE)
    elif not granted:
        assert "canInjectLatency" in refused(peer, CloseCode.FORBIDDEN)
    else:
        assert peer.session.close is None


def test_a_session_gets_its_name_again_at_once_and_nobody_else_does(
    small_balloon: Balloon,
) -> None:
    there = session_host(small_balloon)
    first = say(there, hello(token=token()), source="a")
    session = welcome(first).session
    # The same invitation, the same address, and no secret: another session.
    thief = say(there, hello(token=token()), source="a")
    refused(thief, CloseCode.NAME_TAKEN)
    again = say(there, hello(token=session), source="b")
    assert welcome(again).name == "left"
    assert first.session.close is not None
    assert list(there.room.members) == [again.user]


def test_watch_and_touch_of_a_page_are_one_session_with_a_token_for_one_time(
    small_balloon: Balloon,
) -> None:
    there = session_host(small_balloon, admission(single_use=True))
    watcher = say(there, watch(token=token()))
    session = watching(watcher).session
    toucher = say(there, hello(token=session))
    assert toucher.guest == watcher.guest
    assert "used before" in refused(say(there, watch(token=token())), CloseCode.UNAUTHENTICATED)


def test_a_full_room_uses_up_no_token_for_one_time(small_balloon: Balloon) -> None:
    there = session_host(small_balloon, admission(single_use=True), max_users=1)
    user = say(there, hello("first", token=token(jti="first")))
    refused(say(there, hello(token=token())), CloseCode.ROOM_FULL)
    refused(say(there, hello("first", token=token())), CloseCode.NAME_TAKEN)
    there.disconnect(user, "bye")
    welcome(say(there, hello(token=token())))


def test_who_drops_out_of_the_queue_comes_back_with_a_token_for_one_time(
    small_balloon: Balloon,
) -> None:
    there = session_host(small_balloon, admission(single_use=True), max_users=1)
    user = say(there, hello("first", token=token(jti="first")))
    waiting = say(there, hello(token=token(), wait=True))
    there.serve(0.0)
    first = place(waiting)
    assert first.session is not None
    assert first.session not in repr(first)
    # Told once: a place is news, the session is none.
    second = say(there, hello("second", token=token(jti="second"), wait=True))
    there.serve(0.0)
    assert (place(waiting).session, place(second).place) == (None, 2)
    there.disconnect(waiting, "")
    refused(say(there, hello(token=token(), wait=True)), CloseCode.UNAUTHENTICATED)
    again = say(there, hello(token=first.session, wait=True))
    assert again.guest.session == waiting.guest.session
    there.disconnect(second, "")
    there.disconnect(user, "bye")
    there.serve(0.1)
    say(there, Come(), again)
    messages = [decode_server_control(str(data)) for data in again.session.take(clear=True)]
    assert isinstance(messages[-1], Welcome)


def test_a_key_that_was_taken_out_lets_nobody_in_and_puts_nobody_out(
    small_balloon: Balloon,
) -> None:
    acceptor = admission(RING)
    there = session_host(small_balloon, acceptor)
    inside = say(there, hello(token=token()))
    acceptor.ring = KeyRing((OTHER,))
    refused(say(there, hello("right", token=token())), CloseCode.UNAUTHENTICATED)
    assert inside.session.close is None


def test_a_flood_of_wrong_tokens_spends_the_joins_of_its_address(small_balloon: Balloon) -> None:
    there = session_host(small_balloon)
    codes = [say(there, hello(token="eyJ" + "x" * 2000), source="a") for _ in range(7)]
    closes = [peer.session.close[0] for peer in codes if peer.session.close]
    assert closes == [CloseCode.UNAUTHENTICATED.value] * 5 + [CloseCode.TOO_MANY.value] * 2
    welcome(say(there, hello(token=token()), source="b"))


def test_no_log_and_no_error_tells_a_token(small_balloon: Balloon) -> None:
    there = session_host(small_balloon)
    whole = token()
    for text in [
        encode_control(hello(token=whole)).replace("left", "left\\n"),
        encode_control(hello(token=whole)).replace('"token"', '"tokne"'),
        encode_control(hello(token=whole))[:-1],
        '{"token": "' + whole + '"',
        '{"type": "' + whole + '"}',
        encode_control(hello()).replace("left", whole),
        encode_control(hello(token=whole + "x")),
        encode_control(hello(token=whole)).replace(whole, whole + "\\u00e4"),
        encode_control(hello(token=whole)).replace(whole, whole * 9),
    ]:
        peer = there.connect(0.0, SUBPROTOCOL, SUBPROTOCOL)
        there.receive(peer, text, 0.0, NOW)
        error = str(peer.session.take(clear=True))
        lines = [line.text for line in there.disconnect(peer, "").log]
        for part in whole.split("."):
            assert part[:12] not in error
            assert all(part[:12] not in line for line in lines)
    assert not there.room.members


def test_a_session_has_one_seat_by_whatever_names_its_token_is_used(
    small_balloon: Balloon,
) -> None:
    there = session_host(small_balloon, admission(single_use=True), max_users=2)
    first = say(there, hello("first", token=token()))
    session = welcome(first).session
    newest = first
    for k in range(15):
        before, newest = newest, say(there, hello(f"user{k}", token=session), source=str(k))
        assert before.session.close is not None
        assert "its only connection" in before.session.close[1]
        assert list(there.room.members) == [newest.user]
        if k % 3:
            there.disconnect(before, "")
    # Nor does one that is lost leave a seat behind for each name.
    for k in range(5):
        there.tick(100.0 * k)
        there.disconnect(newest, "")
        newest = say(there, hello(f"lost{k}", token=session), source=f"lost{k}")
        assert there.room.seated(0.0) == 1
    second = say(there, hello("second", token=token(jti="second")), source="elsewhere")
    assert list(there.room.members) == [newest.user, second.user]


def test_the_others_hear_that_a_session_goes_by_another_name(small_balloon: Balloon) -> None:
    there = session_host(small_balloon)
    other = say(there, hello("other", token=token(jti="other")))
    ann = say(there, hello("ann", token=token()))
    other.session.take(clear=True)
    bob = say(there, hello("bob", token=welcome(ann).session))
    assert [decode_server_control(str(data)) for data in other.session.take(clear=True)] == [
        UserLeft(user=ann.user or 0, name="ann", reason="replaced by its return"),
        UserJoined(user=bob.user or 0, name="bob"),
    ]
    # A name of somebody else is no more to be had this way than by any other.
    refused(say(there, hello("other", token=welcome(bob).session)), CloseCode.NAME_TAKEN)
    assert bob.session.close is None


def test_a_session_has_one_place_in_the_queue_by_whatever_names(small_balloon: Balloon) -> None:
    there = session_host(small_balloon, max_users=1)
    user = say(there, hello("user", token=token(jti="user")))
    newest = say(there, hello("first", token=token(), wait=True))
    there.serve(0.0)
    session = place(newest).session
    for k in range(6):
        before = newest
        newest = say(there, hello(f"name{k}", token=session, wait=True), source=str(k))
        assert before.session.close is not None
        assert len(there.room.queue) == len(there.session_setup.waiting) == 1
    # Who finds a seat by another name waits no more.
    there.disconnect(user, "bye")
    seated = say(there, hello("seated", token=session), source="seat")
    refused(seated, CloseCode.ROOM_FULL)  # it has to be called
    there.serve(0.0)
    say(there, Come(), newest)
    assert [m.hello.name for m in there.room.members.values()] == ["name5"]
    assert len(there.room.queue) == 0


def test_the_pages_of_a_session_that_watch_are_few_and_cost_no_other_a_place(
    small_balloon: Balloon,
) -> None:
    there = session_host(small_balloon, admission(single_use=True))
    pages = [say(there, watch(token=token()))]
    session = watching(pages[0]).session
    for k in range(1, MAX_PAGES):
        pages.append(say(there, watch(token=session), source=str(k)))
    words = refused(say(there, watch(token=session), source="more"), CloseCode.ROOM_FULL)
    assert f"is {MAX_PAGES + 1}; expected at most {MAX_PAGES}" in words
    assert len(there.scene_broadcast.watchers) == MAX_PAGES
    welcome(say(there, hello(token=session), source="hand"))
    watching(say(there, watch(token=token(jti="second")), source="second"))
    there.disconnect(pages[0], "")
    watching(say(there, watch(token=session), source="again"))


def test_a_place_that_takes_the_turn_of_one_not_sent_yet_says_the_session_too(
    small_balloon: Balloon,
) -> None:
    there = session_host(small_balloon, admission(single_use=True), max_users=1)
    say(there, hello("first", token=token(jti="first")))
    waiting = say(there, hello(token=token(), wait=True))
    there.serve(0.0)
    say(there, hello("second", token=token(jti="second"), wait=True))
    there.serve(0.0)
    reported = place(waiting)
    assert reported.of == 2
    assert reported.session is not None


def test_whoever_is_connected_goes_when_its_session_is_over(small_balloon: Balloon) -> None:
    there = session_host(small_balloon, admission(session_valid=60.0), max_users=1)
    hand, page = say(there, hello(token=token())), say(there, watch(token=token()))
    waits = say(there, hello("waits", token=token(), wait=True))
    session = welcome(hand).session
    later = say(there, watch(token=token(jti="later", exp=NOW + 900.0)), source="b")
    peers = (hand, page, waits)
    there.serve(659.0)  # the invitation ends after 600 s
    assert all(peer.session.close is None for peer in peers)
    outcome = there.serve(660.0)
    for peer in peers:
        assert peer in outcome.flush
        assert "ended with its invitation" in refused(peer, CloseCode.UNAUTHENTICATED)
        there.disconnect(peer, "")
    assert later.session.close is None
    assert there.room.seated(660.0) == 0  # neither name nor seat is kept
    back = there.connect(660.0, SUBPROTOCOL, SUBPROTOCOL)
    there.receive(back, encode_control(hello(token=session)), 660.0, NOW)
    refused(back, CloseCode.UNAUTHENTICATED)
