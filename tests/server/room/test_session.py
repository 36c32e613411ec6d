from __future__ import annotations

import json
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.errors import CloseCode, RemoteProtocolError
from cohaptic.protocol.contact_sample import ContactSample
from cohaptic.protocol.messages import (
    Bye,
    decode_server_control,
    encode_control,
)
from cohaptic.protocol.patch import Patch
from cohaptic.protocol.version import PROTOCOL_VERSION
from cohaptic_server.room.life import HELLO_TIMEOUT, Message, State
from cohaptic_server.room.life import MESSAGES as ALLOWED
from cohaptic_server.room.outbox import MAX_EVENTS
from cohaptic_server.room.session import ServerSession
from tests.client.plane import PLANE
from tests.server.peers import hello, hello_text, sample, text
from tests.server.room.sessions import (
    ANSWER,
    MESSAGES,
    STATES,
    WELCOME,
    ended,
    last_words,
    session_in,
)
from tests.strategies import patches

CLOSE_REASON_BYTES = 123  # RFC 6455, section 5.5: 125 bytes of payload, two of them for the code

anything_said = st.text(max_size=200) | st.binary(max_size=200)


@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize("kind", MESSAGES)
def test_a_message_passes_where_the_table_allows_it_and_nowhere_else(
    state: State, kind: type[Message]
) -> None:
    session = session_in(state)
    session.receive(MESSAGES[kind], 0.0)
    events = session.events()
    if kind in ALLOWED.get(state, ()):
        assert [type(event) for event in events] == [kind]
    elif state in (State.KEPT, State.GONE):
        # What comes after the end is not answered: the end was.
        assert events == []
        assert session.outbox.take(clear=True) == []
    else:
        assert events == []
        assert f"message is '{kind.__name__}'; expected" in last_words(session).message
        assert ended(session)[0] == CloseCode.BAD_MESSAGE.value


def test_the_ordinary_life_of_a_session() -> None:
    session = ServerSession(0.0)
    session.receive(hello_text("left"), 1.0)
    assert (session.state, session.events()) == (State.ASKING, [hello("left")])
    session.accept(WELCOME)
    written = session.outbox.take(clear=True)
    assert session.state is State.JOINED
    assert [decode_server_control(str(w)) for w in written] == [WELCOME]
    session.receive(sample(1).encode(), 1.1)
    session.receive(sample(2).encode(), 1.2)
    assert [type(event) for event in session.events()] == [ContactSample, ContactSample]
    assert session.close is None
    session.receive(encode_control(Bye()), 1.3)
    assert session.events() == [Bye()]
    assert ended(session) == (1000, "bye")


@pytest.mark.parametrize("state", STATES)
@given(said=st.lists(anything_said, max_size=4))
def test_whatever_is_said_nothing_is_raised_and_the_end_is_one_printable_line(
    state: State, said: list[str | bytes]
) -> None:
    session = session_in(state)
    for data in said:
        session.receive(data, 0.0)
    if session.close is not None:
        code, reason = session.close
        assert code in {1000, *(c.value for c in CloseCode)}
        assert reason.isprintable()
        assert 0 < len(reason.encode()) <= CLOSE_REASON_BYTES


json_text = st.text(max_size=40)


@given(
    fields=st.dictionaries(json_text, json_text | st.integers(), max_size=3),
    kind=json_text | st.sampled_from(["hello", "bye"]),
)
def test_no_field_of_a_stranger_reaches_a_terminal_as_it_is(
    fields: dict[str, object], kind: str
) -> None:
    """The error quotes the client; it goes into logs and onto screens."""
    session = session_in(State.JOINED)
    session.receive(json.dumps(fields | {"type": kind}), 0.0)
    if session.state is State.GONE and session.close != (1000, "bye"):
        error = last_words(session)
        assert error.message.isprintable()
        assert len(error.message) < 400


@pytest.mark.parametrize("wide", ["x", "é", "漢", "🎈"])
@pytest.mark.parametrize("offset", range(4))
def test_a_close_reason_fits_its_frame_whatever_alphabet_it_is_in(wide: str, offset: int) -> None:
    """Letters of two to four bytes are cut between letters, not within one."""
    session = session_in(State.JOINED)
    session.fail(RemoteProtocolError("x" * offset + wide * 500, 1, "something short"))
    _, reason = ended(session)
    assert CLOSE_REASON_BYTES - 7 <= len(reason.encode()) <= CLOSE_REASON_BYTES
    assert reason == "x" * offset + wide * (len(reason) - offset)


def test_a_mistake_ends_its_own_session_only() -> None:
    guilty, innocent = session_in(State.JOINED), session_in(State.JOINED)
    guilty.receive(b"garbage", 0.0)
    assert guilty.state is State.GONE
    assert (innocent.state, innocent.close) == (State.JOINED, None)
    assert innocent.outbox.take(clear=True) == []


@given(st.lists(st.integers(1, 2**32 - 1), min_size=1, max_size=8))
def test_sequence_numbers_rise_or_the_session_ends(numbers: list[int]) -> None:
    session = session_in(State.JOINED)
    last = 0
    for seq in numbers:
        session.receive(sample(seq).encode(), 0.0)
        if seq <= last:
            words = f"seq of a contact sample is {seq}; expected more than the last one, {last}"
            assert last_words(session).message == words
            assert session.events() == []
            return
        assert [event.seq for event in session.events() if isinstance(event, ContactSample)] == [
            seq
        ]
        last = seq


@given(st.floats(0.0, 1e6), st.floats(0.0, 2.0 * HELLO_TIMEOUT))
def test_who_says_no_hello_in_time_is_told_and_closed(start: float, later: float) -> None:
    session = ServerSession(start)
    assert session.next_deadline() == start + HELLO_TIMEOUT
    session.handle_timer(start + later)
    late = start + later >= start + HELLO_TIMEOUT
    assert (session.state is State.GONE) == late
    if late:
        assert ended(session)[0] == CloseCode.HELLO_TIMEOUT.value
        assert f"{HELLO_TIMEOUT:g} s" in last_words(session).message


def test_a_hello_that_comes_with_the_deadline_is_too_late() -> None:
    session = ServerSession(0.0)
    session.receive(hello_text(), HELLO_TIMEOUT)
    assert session.events() == []
    assert session.state is State.GONE


@pytest.mark.parametrize("state", [s for s in STATES if s is not State.OFFERED])
def test_time_ends_no_session_that_has_said_hello(state: State) -> None:
    session = session_in(state)
    close = session.close
    assert session.next_deadline() is None
    session.handle_timer(1e9)
    assert (session.state, session.close) == (state, close)


def test_a_client_that_lets_events_pile_up_is_closed_and_told_why() -> None:
    session = session_in(State.JOINED)
    for _ in range(MAX_EVENTS):
        session.send(ANSWER)
    assert session.close is None
    session.send(ANSWER)
    code, reason = ended(session)
    assert code == CloseCode.TOO_SLOW.value
    assert str(MAX_EVENTS) in reason


def test_an_error_wins_over_a_full_outbox() -> None:
    """The client cannot be told in a message, so the close says what it did."""
    session = session_in(State.JOINED)
    for _ in range(MAX_EVENTS):
        session.send(ANSWER)
    session.receive(b"", 0.0)
    code, reason = ended(session)
    assert code == CloseCode.BAD_MESSAGE.value
    assert "frame length is 0" in reason


@given(st.lists(patches, min_size=1, max_size=5))
def test_a_joined_client_gets_the_newest_patch_and_nobody_else_gets_any(made: list[Patch]) -> None:
    for state in STATES:
        session = session_in(state)
        for patch in made:
            session.send_patch(patch)
        written = session.outbox.take(clear=True)
        assert written == ([made[-1].encode()] if state is State.JOINED else [])


@given(patches, st.sampled_from([1e7, -1.0, float("nan")]))
def test_a_patch_that_the_wire_cannot_carry_is_left_out_and_ends_neither_session_nor_tick(
    patch: Patch, wait: float
) -> None:
    """A body that others push out of the world: their victim stays, and its loop fades."""
    session = session_in(State.JOINED)
    session.outbox.take(clear=True)
    session.send_patch(replace(patch, sample_wait=wait))
    assert session.state is State.JOINED
    assert session.outbox.take(clear=True) == []
    assert f"sample_wait is {wait}" in session.problem
    session.send_patch(patch)
    assert session.outbox.take(clear=True) == [patch.encode()]
    assert session.problem == ""


def test_a_server_that_stops_says_so_and_forgets_no_earlier_end() -> None:
    session = session_in(State.JOINED)
    session.stop(CloseCode.SERVER_STOPS, "the server stops")
    assert session.close == (CloseCode.SERVER_STOPS.value, "the server stops")
    failed = session_in(State.JOINED)
    failed.receive("{", 0.0)
    first = failed.close
    failed.stop(CloseCode.SERVER_STOPS, "the server stops")
    failed.fail(RemoteProtocolError("later", 1, "nothing"))
    assert failed.close == first


OTHER_VERSION = f"version is 9; expected {PROTOCOL_VERSION}"


@pytest.mark.parametrize(
    ("said", "code", "field", "words"),
    [
        ("hello?", CloseCode.BAD_MESSAGE, "control_message", "Invalid JSON"),
        (text("dance"), CloseCode.BAD_MESSAGE, "control_message", "'dance'"),
        (
            text("hello", protocol=99, name="left"),
            CloseCode.WRONG_VERSION,
            "protocol",
            "version is 99",
        ),
        (
            text("hello", protocol=1, name="x" * 33),
            CloseCode.BAD_MESSAGE,
            "hello.name",
            "at most 32",
        ),
        (
            text("hello", protocol=1, name="left", max_force=1e9),
            CloseCode.BAD_MESSAGE,
            "hello.max_force",
            "100",
        ),
        ("x" * 5000, CloseCode.BAD_MESSAGE, "length", "5000; expected <= 4096"),
        (b"", CloseCode.BAD_MESSAGE, "length", "frame length is 0; expected at least 4"),
        (
            sample().encode()[:-1],
            CloseCode.BAD_MESSAGE,
            "length",
            "length is 43; expected 44 bytes",
        ),
        (b"\x09" + sample().encode()[1:], CloseCode.WRONG_VERSION, "version", OTHER_VERSION),
    ],
)
def test_the_last_words_name_what_came_and_what_was_expected(
    said: str | bytes, code: CloseCode, field: str, words: str
) -> None:
    session = session_in(State.OFFERED)
    session.receive(said, 0.0)
    error = last_words(session)
    assert (error.code, error.field) == (code.value, field)
    assert words in error.message
    assert ended(session) == (code.value, error.message.encode()[:120].decode(errors="ignore"))


def test_the_rest_mesh_goes_out_once_between_the_welcome_and_the_first_patch() -> None:
    session = session_in(State.OFFERED)
    session.receive(hello_text(), 0.0)
    session.accept(WELCOME, b"mesh")
    session.send_patch(PLANE)
    session.send_patch(PLANE)
    first, second, *rest = session.outbox.take(clear=True)
    assert isinstance(first, str)
    assert decode_server_control(first) == WELCOME
    assert (second, rest) == (b"mesh", [PLANE.encode()])
