"""The table of a participant's life is whole, and the docs have the table of today."""

from __future__ import annotations

from functools import reduce
from importlib import import_module

import pytest

import life_of_a_participant as docs
from cohaptic.errors import CloseCode
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


def test_the_docs_have_the_table_and_the_drawing_of_today() -> None:
    page = docs.PAGE.read_text(encoding="utf-8")
    assert docs.written(page) == page, "run `make life`"
    assert docs.PICTURE.read_text(encoding="utf-8") == docs.picture(), "run `make life`"
