from __future__ import annotations

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.room.peer import Outcome
from tests.server.peers import hello_text
from tests.server.room.test_session_host import connect, say, session_host


def test_a_name_that_draws_on_terminals_is_logged_as_one_printable_line(
    small_balloon: Balloon,
) -> None:
    """Characters that change the direction of text, or have no width, are no control characters."""
    there = session_host(small_balloon)
    peer, stranger = connect(there), connect(there)
    (line,) = say(there, peer, hello_text("a\u0301\u0332b")).log
    assert line.text.isprintable()
    assert line.text.endswith("b joined with predictive")
    (line,) = there.disconnect(peer, "gone\x1b[2J").log
    assert line.text.endswith("b left: gone?[2J")
    say(there, stranger, hello_text("name").replace('name"', 'a\u202e\u200bb"'))
    (line,) = there.disconnect(stranger, "").log
    assert line.text.isprintable()
    assert line.event == "refused"


@given(st.text(max_size=2000))
def test_whatever_is_said_a_line_of_the_log_is_short_and_printable(text: str) -> None:
    outcome = Outcome()
    outcome.say("joined", text, "somewhere", user=text)
    (line,) = outcome.log
    assert line.text.isprintable()
    assert len(line.text) <= 403
    assert line.user == line.text


def hello_with(**wishes: object) -> str:
    return json.dumps(json.loads(hello_text("bob")) | wishes)


@pytest.mark.parametrize(
    ("said", "field"),
    [
        (hello_text("ann"), "name"),
        (hello_with(fixed_gains={"k_h": 1.0}), "fixed_gains"),
        (hello_with(max_force=1e9), "hello.max_force"),
        (b"", "length"),
    ],
)
def test_the_log_names_the_field_for_which_somebody_was_refused(
    small_balloon: Balloon, said: str | bytes, field: str
) -> None:
    there = session_host(small_balloon)
    say(there, connect(there), hello_text("ann"))
    peer = connect(there)
    say(there, peer, said)
    (line,) = there.disconnect(peer, "").log
    assert peer.session.close is not None
    assert (line.event, line.field, line.code) == ("refused", field, peer.session.close[0])
