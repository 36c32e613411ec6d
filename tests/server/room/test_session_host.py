"""Joining, watching, laws and latency, without a socket or a clock."""

from __future__ import annotations

from typing import Any

import pytest

from cohaptic.control.law import Law
from cohaptic.errors import CloseCode, ProtocolError
from cohaptic.protocol.messages import (
    Bye,
    Error,
    FixedGains,
    SetLaw,
    UserJoined,
    UserLeft,
    decode_server_control,
    encode_control,
)
from cohaptic.protocol.version import PROTOCOL_VERSION, SUBPROTOCOL
from cohaptic.protocol.watch_messages import (
    Latency,
    SetLatency,
    Watch,
    Watching,
    decode_watch_control,
)
from cohaptic.simulated.delay_line import LinkSettings
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.bodies.body import Body
from cohaptic_server.room.peer import LogLine, Outcome, Peer
from cohaptic_server.room.room import Room
from cohaptic_server.room.seats.names import REPLACE_AFTER
from cohaptic_server.room.session_host import SessionHost
from cohaptic_server.room.watch.scene_broadcast import SceneBroadcast
from cohaptic_server.settings import ServerSettings
from tests.server.peers import hello_text, sample

TO_WALL = 1e9  # s
WATCH = encode_control(Watch(protocol=PROTOCOL_VERSION))


def session_host(body: Body, **settings: Any) -> SessionHost:
    room = Room(body, ServerSettings(**settings))
    return SessionHost(room, SceneBroadcast(room, model=None))


def connect(there: SessionHost, now: float = 0.0) -> Peer:
    return there.connect(now, SUBPROTOCOL, SUBPROTOCOL)


def say(there: SessionHost, peer: Peer, data: str | bytes, now: float = 0.0) -> Outcome:
    return there.receive(peer, data, now, TO_WALL)


def join(there: SessionHost, name: str, now: float = 0.0) -> Peer:
    peer = connect(there, now)
    say(there, peer, hello_text(name), now)
    return peer


def watch(there: SessionHost) -> Peer:
    """A watcher that has the mesh."""
    peer = connect(there)
    say(there, peer, WATCH)
    there.begin_mesh(peer)
    there.finish_mesh(peer, 0.0, taken=True, clear=True)
    peer.session.take(clear=True)
    return peer


def news(peer: Peer) -> list[Any]:
    """Control messages that wait for a user."""
    waiting = peer.session.take(clear=True)
    return [decode_server_control(data) for data in waiting if isinstance(data, str)]


def test_another_subprotocol_is_refused_in_a_sentence(small_balloon: Balloon) -> None:
    there = session_host(small_balloon)
    peer = there.connect(0.0, None, None)
    (error,) = news(peer)
    assert isinstance(error, Error)
    assert "not named as a subprotocol" in error.message
    assert peer.session.close is not None
    outcome = there.disconnect(peer, "")
    (line,) = outcome.log
    assert line.text.startswith("a client was refused: protocol version is")
    assert (there.peers, line.warning) == ([], False)


def test_a_name_in_use_is_refused_and_nobody_hears_of_it(small_balloon: Balloon) -> None:
    there = session_host(small_balloon)
    first = join(there, "ann")
    news(first)
    second = connect(there)
    outcome = say(there, second, hello_text("ann"), REPLACE_AFTER - 0.1)
    assert (outcome.flush, outcome.log) == ([second], [])
    assert second.session.close is not None
    assert second.session.close[0] == CloseCode.NAME_TAKEN.value
    assert news(first) == []


@pytest.mark.parametrize("code", [None, *CloseCode])
@pytest.mark.parametrize("farewell", [True, False])
def test_a_name_is_kept_where_nobody_ended_the_session_but_the_path_or_the_server(
    small_balloon: Balloon, code: CloseCode | None, farewell: bool
) -> None:
    there = session_host(small_balloon, max_users=1)
    peer = there.connect(0.0, SUBPROTOCOL, None, source="home")
    say(there, peer, hello_text("ann"))
    there.tick(10.0)
    if code is not None:
        peer.session.fail(ProtocolError("ann", "here", "elsewhere", code))
    peer.farewell = farewell
    there.disconnect(peer, "")
    spared = (CloseCode.TOO_SLOW, CloseCode.OBJECT_CHANGED, CloseCode.SERVER_STOPS)
    kept = code is None or (code in spared and not farewell)
    for name, kept_too in (("ann", kept), ("bob", kept and not farewell)):
        other = there.connect(10.0, SUBPROTOCOL, None, source="elsewhere")
        say(there, other, hello_text(name), 10.0)
        assert (other.session.close is not None) == kept_too
        there.disconnect(other, "bye")


@pytest.mark.parametrize(("said", "reason"), [(encode_control(Bye()), ""), ("", "x")])
def test_a_name_is_kept_no_more_where_its_owner_ended_the_session(
    small_balloon: Balloon, said: str, reason: str
) -> None:
    there = session_host(small_balloon)
    peer = there.connect(0.0, SUBPROTOCOL, None, source="home")
    say(there, peer, hello_text("ann"))
    if said:
        say(there, peer, said)
    there.disconnect(peer, reason)
    other = there.connect(0.0, SUBPROTOCOL, None, source="elsewhere")
    say(there, other, hello_text("ann"))
    assert other.session.close is None


def test_a_silent_user_is_replaced_by_its_return(small_balloon: Balloon) -> None:
    there = session_host(small_balloon)
    other, old = join(there, "other"), join(there, "ann")
    news(other)
    new = join(there, "ann", REPLACE_AFTER)
    assert old.session.close is not None
    assert "it has come back with another" in old.session.close[1]
    assert news(other) == [
        UserLeft(user=old.user or 0, name="ann", reason="replaced by its return"),
        UserJoined(user=new.user or 0, name="ann"),
    ]
    # When its connection ends, everybody has heard of it already.
    assert there.disconnect(old, "").log == []
    assert news(other) == []


@pytest.mark.parametrize(
    ("said", "reason", "reported"),
    [
        (encode_control(Bye()), "", "bye"),
        (None, "", "connection lost"),
        (None, "for lunch", "for lunch"),
    ],
)
def test_who_leaves_is_told_to_the_others_with_the_reason(
    small_balloon: Balloon, said: str | None, reason: str, reported: str
) -> None:
    there = session_host(small_balloon)
    stays, leaves = join(there, "stays"), join(there, "leaves")
    news(stays)
    if said is not None:
        say(there, leaves, said)
    outcome = there.disconnect(leaves, reason)
    assert outcome.log == [LogLine(f"leaves left: {reported}", event="left", user="leaves")]
    assert outcome.flush == [stays]
    assert news(stays) == [UserLeft(user=leaves.user or 0, name="leaves", reason=reported)]
    assert there.peers == [stays]


def test_a_patch_that_the_wire_cannot_carry_is_logged_once(small_balloon: Balloon) -> None:
    there = session_host(small_balloon)
    peer = join(there, "ann")
    say(there, peer, sample().encode())
    lines: list[LogLine] = []
    for now in (1.1e6, 1.1e6 + 0.01):
        there.tick(now)
        lines += there.serve(now).log
    (line,) = lines
    assert line.warning
    assert line.text.startswith("ann gets no patch: sample_wait is 1100000")


@pytest.mark.parametrize("allowed", [True, False])
def test_a_law_is_changed_with_gains_only_where_they_are_allowed(
    small_balloon: Balloon, allowed: bool
) -> None:
    there = session_host(small_balloon, allow_fixed_gains=allowed)
    peer = join(there, "ann")
    say(there, peer, encode_control(SetLaw(law=Law.PI)))
    assert there.room.members[peer.user or 0].hello.law is Law.PI
    change = SetLaw(law=Law.PROPORTIONAL, fixed_gains=FixedGains(k_h=100.0))
    say(there, peer, encode_control(change))
    assert (peer.session.close is None) == allowed
    expected = Law.PROPORTIONAL if allowed else Law.PI
    assert there.room.members[peer.user or 0].hello.law is expected


def test_a_watcher_gets_its_welcome_then_the_mesh_then_the_latencies(
    small_balloon: Balloon,
) -> None:
    there = session_host(small_balloon, allow_latency=True)
    user, first = join(there, "ann"), watch(there)
    say(there, first, encode_control(SetLatency(user=user.user or 0, delay=0.1, jitter=0.0)))
    peer = connect(there)
    outcome = say(there, peer, WATCH)
    assert (outcome.flush, outcome.log) == ([peer], [])
    assert peer.needs_mesh
    (welcome,) = peer.session.take(clear=True)
    assert isinstance(welcome, str)
    assert isinstance(decode_watch_control(welcome), Watching)
    assert there.begin_mesh(peer) == there.room.frames.rest_mesh()
    assert not peer.needs_mesh
    (latency,) = peer.session.take(clear=True)
    assert isinstance(latency, str)
    reported = decode_watch_control(latency)
    assert reported == Latency(user=user.user or 0, delay=0.1, jitter=0.0)


def test_a_watcher_that_does_not_take_the_mesh_is_too_slow(small_balloon: Balloon) -> None:
    there = session_host(small_balloon)
    peer = connect(there)
    say(there, peer, WATCH)
    there.begin_mesh(peer)
    there.finish_mesh(peer, 30.0, taken=False, clear=False)
    assert peer.session.close is not None
    assert peer.session.close[0] == CloseCode.TOO_SLOW.value
    (line,) = there.disconnect(peer, "").log
    assert line.text.startswith("one who watches left: rest mesh is 'not taken'")
    assert there.scene_broadcast.watchers == set()


def test_latency_is_injected_where_it_is_allowed_and_told_to_every_watcher(
    small_balloon: Balloon,
) -> None:
    there = session_host(small_balloon, allow_latency=True)
    user, asks, sees = join(there, "ann"), watch(there), watch(there)
    change = encode_control(SetLatency(user=user.user or 0, delay=0.2, jitter=0.05))
    outcome = say(there, asks, change)
    assert (outcome.delayed, user.latency) == ([user], LinkSettings(0.2, 0.05))
    for peer in (asks, sees):
        (reported,) = peer.session.take(clear=True)
        assert isinstance(reported, str)
        assert decode_watch_control(reported) == Latency(
            user=user.user or 0, delay=0.2, jitter=0.05
        )
    # The same again changes nothing, and is no news.
    assert say(there, asks, change).delayed == []
    assert sees.session.take(clear=True) == []


def test_latency_is_refused_where_it_is_not_allowed(small_balloon: Balloon) -> None:
    there = session_host(small_balloon)
    user, peer = join(there, "ann"), watch(there)
    change = SetLatency(user=user.user or 0, delay=0.2, jitter=0.0)
    assert say(there, peer, encode_control(change)).delayed == []
    assert user.latency.at_once
    assert peer.session.close is not None
    assert "--allow-latency" in peer.session.close[1]
