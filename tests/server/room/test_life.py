"""The table of a participant's life is whole, and the docs have the table of today."""

from __future__ import annotations

import json
from functools import reduce
from importlib import import_module
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

import life_of_a_participant as docs
from cohaptic.errors import CloseCode
from cohaptic.protocol.version import SUBPROTOCOL
from cohaptic_server.bodies.spring import Spring
from cohaptic_server.room.life import (
    LIFE,
    MESSAGES,
    STALE_AFTER,
    Event,
    Hand,
    State,
    after,
    closed_by_server,
    hand_of,
)
from cohaptic_server.room.peer import Peer
from cohaptic_server.room.session_host import SessionHost
from tests.server.peers import hello_text, sample, text
from tests.server.room.test_session_host import session_host


def test_no_event_leads_from_one_state_to_two() -> None:
    pairs = [(before, step.event) for step in LIFE for before in step.before]
    assert len(pairs) == len(set(pairs))


@pytest.mark.parametrize("state", State)
@pytest.mark.parametrize("event", Event)
def test_an_event_that_the_table_lacks_is_a_fault_and_never_a_state(
    state: State, event: Event
) -> None:
    rows = [step for step in LIFE if state in step.before and step.event is event]
    if rows:
        assert after(state, event) is rows[0].after
    else:
        with pytest.raises(ValueError, match="a participant that"):
            after(state, event)


def test_every_state_is_reached_and_only_the_end_is_final() -> None:
    reached, grown = {State.OFFERED}, True
    while grown:
        steps = {s.after for s in LIFE if reached & set(s.before)}
        grown, reached = not steps <= reached, reached | steps
    assert reached == set(State)
    assert {state for state in State if not any(state in s.before for s in LIFE)} == {State.GONE}


def test_only_a_seat_is_kept_and_only_for_one_without_fault() -> None:
    assert [s.before for s in LIFE if s.after is State.KEPT] == [(State.JOINED,)]
    for code in CloseCode:
        kept = after(State.JOINED, closed_by_server(code)) is State.KEPT
        assert kept == (code.name in {"TOO_SLOW", "OBJECT_CHANGED", "SERVER_STOPS"})


def test_nobody_may_send_anything_from_where_no_connection_is() -> None:
    assert not {State.KEPT, State.GONE} & set(MESSAGES)


def test_the_functions_that_decide_each_event_exist() -> None:
    for step in LIFE:
        for where in step.where.split():
            module, _, name = where.partition(":")
            found = import_module(f"cohaptic_server.room.{module}")
            assert callable(reduce(getattr, name.split("."), found)), where


def test_a_hand_acts_where_nothing_holds_it() -> None:
    assert hand_of(frozen=False, muted=False, silence=STALE_AFTER) is Hand.ACTS
    assert hand_of(frozen=False, muted=False, silence=2.0 * STALE_AFTER) is Hand.SILENT
    assert hand_of(frozen=False, muted=True, silence=2.0 * STALE_AFTER) is Hand.MUTED
    assert hand_of(frozen=True, muted=True, silence=0.0) is Hand.FROZEN


def hello_of_somebody(draw: Random) -> str:
    hello = json.loads(hello_text(draw.choice(["ann", "bob", "cid"])))
    wishes = {"wait": draw.random() < 0.8, "key": draw.choice(["k", "l"]) * 16}
    return json.dumps(hello | wishes)


def one_thing(host: SessionHost, peer: Peer, draw: Random, seq: int, now: float) -> None:
    """Whatever a client may say, and what ends a connection beside it."""
    said: list[str | bytes] = [
        hello_of_somebody(draw),
        text("come"),
        text("bye"),
        text("set_name", name="dan"),
    ]
    said += [text("watch", protocol=5), sample(seq).encode(), "{}"]
    host.receive(peer, draw.choice(said), now, 0.0)
    if draw.random() < 0.05:
        peer.ends = now
    if draw.random() < 0.02:
        host.stop(draw.choice(list(CloseCode)), "why")
    if peer.session.close is not None or draw.random() < 0.15:
        peer.farewell = draw.random() < 0.5
        host.disconnect(peer, draw.choice(["", "gone"]))


@given(st.randoms(use_true_random=False))
def test_no_order_of_events_is_one_that_the_table_lacks(draw: Random) -> None:
    """An event that cannot happen would end the tick for everybody in the room."""
    host, now = session_host(Spring(), max_users=2, max_waiting=3), 0.0
    for seq in range(1, 80):
        now += draw.choice([0.02, 0.02, 0.02, 0.3, 6.0])
        if not host.peers or draw.random() < 0.2:
            peer = host.connect(now, SUBPROTOCOL, SUBPROTOCOL, draw.choice("ab"))
            host.receive(peer, hello_of_somebody(draw), now, 0.0)
        if draw.random() < 0.3:  # else nothing comes, so that turns are missed and hands are silent
            one_thing(host, draw.choice(host.peers), draw, seq, now)
        host.tick(now)
        host.serve(now)
        for peer in host.peers:
            peer.session.take(clear=True)
            joined = peer.session.state is State.JOINED
            assert joined == (peer.user is not None and peer.session.close is None)


def test_the_docs_have_the_table_and_the_drawing_of_today() -> None:
    page = docs.PAGE.read_text(encoding="utf-8")
    assert docs.written(page) == page, "run `make life`"
    assert docs.PICTURE.read_text(encoding="utf-8") == docs.picture(), "run `make life`"
