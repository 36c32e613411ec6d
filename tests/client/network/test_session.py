from __future__ import annotations

import contextlib
import json
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic.errors import RemoteProtocolError
from cohaptic.protocol.contact_sample import ContactSample
from cohaptic.protocol.messages import (
    BodyInfo,
    Bye,
    Error,
    Hello,
    UserJoined,
    UserLeft,
    Welcome,
    decode_client_control,
    encode_control,
)
from cohaptic.protocol.neighbourhood import Neighbourhood
from cohaptic.protocol.patch import SIZE, Geometry, Patch
from cohaptic.protocol.rest_mesh import RestMesh
from cohaptic.protocol.version import PROTOCOL_VERSION
from cohaptic_client.network.session import ALLOWED, ClientSession, Event, State
from tests.client.plane import PLANE
from tests.examples_of_laws import examples
from tests.strategies import contact_samples, patches

BODY = BodyInfo(name="balloon", center=(0.0, 0.0, 0.0), radius=0.1, contact_radius=0.02)
WELCOME = Welcome(user=1, name="left", simulation_period=0.0625, body=BODY, users=())
ERROR = Error(code=4409, message="name is 'left'; expected one that is free (taken: left)")
SPOKEN: dict[str, Event] = {
    "welcome": WELCOME,
    "user_joined": UserJoined(user=2, name="right"),
    "user_left": UserLeft(user=2, name="right", reason="left"),
    "error": ERROR,
}
REST_MESH = RestMesh(((0.0, 0.0, 0.0), (0.125, 0.0, 0.0), (0.0, 0.125, 0.0)), ((0, 1, 2),))
HELLO = Hello(protocol=PROTOCOL_VERSION, name="left")
messages = st.one_of(st.sampled_from(list(SPOKEN.values())), patches)
spoken: st.SearchStrategy[Event] = st.sampled_from([*SPOKEN.values(), PLANE])


def wire(message: Event) -> str | bytes:
    if isinstance(message, Patch | RestMesh):
        return message.encode()
    return encode_control(message)


def session_in(state: State) -> ClientSession:
    """A session that came to a state by its messages."""
    session = ClientSession()
    if state is not State.AWAIT_WELCOME:
        session.receive(wire(WELCOME))
    if state is State.CLOSED:
        session.receive(wire(ERROR))
    assert session.state is state
    return session


def next_state(state: State, message: Event) -> State:
    """The table of the session's life, as docs/protocol.md says it."""
    if isinstance(message, Welcome):
        return State.JOINED
    return State.CLOSED if isinstance(message, Error) else state


@pytest.mark.parametrize("state", State)
@given(message=messages)
@settings(max_examples=examples(50))
def test_each_message_is_allowed_by_the_table_or_ends_the_session(
    state: State, message: Event
) -> None:
    session = session_in(state)
    if isinstance(message, ALLOWED[state]):
        assert session.receive(wire(message)) == message
        assert session.state is next_state(state, message)
    else:
        with pytest.raises(RemoteProtocolError, match=f"expected .*: {state.value}"):
            session.receive(wire(message))
        assert session.state is State.CLOSED


@pytest.mark.parametrize(
    ("state", "allowed"),
    [
        (State.AWAIT_WELCOME, {"welcome", "error"}),
        (State.JOINED, {"patch", "rest_mesh", "user_joined", "user_left", "error"}),
        (State.CLOSED, set[str]()),
    ],
)
def test_the_table_is_that_of_the_protocol(state: State, allowed: set[str]) -> None:
    understood = set[str]()
    for name, message in {**SPOKEN, "patch": PLANE, "rest_mesh": REST_MESH}.items():
        with contextlib.suppress(RemoteProtocolError):
            session_in(state).receive(wire(message))
            understood.add(name)
    assert understood == allowed


@given(st.lists(spoken, max_size=12))
def test_whatever_the_order_the_state_follows_the_table_and_closed_is_the_end(
    order: list[Event],
) -> None:
    session, expected = ClientSession(), State.AWAIT_WELCOME
    for message in order:
        if isinstance(message, ALLOWED[expected]):
            session.receive(wire(message))
            expected = next_state(expected, message)
        else:
            with pytest.raises(RemoteProtocolError):
                session.receive(wire(message))
            expected = State.CLOSED
        assert session.state is expected


@pytest.mark.parametrize("state", State)
@given(data=st.one_of(st.text(max_size=200), st.binary(max_size=200), st.binary(min_size=SIZE)))
def test_any_text_and_any_bytes_raise_nothing_but_the_peers_error(
    state: State, data: str | bytes
) -> None:
    with contextlib.suppress(RemoteProtocolError):
        session_in(state).receive(data)


@given(
    st.sampled_from(["welcome", "user_joined", "user_left", "error", "hello"]),
    st.dictionaries(
        st.sampled_from(["user", "name", "body", "code", "users", "reason", "message"]),
        st.one_of(st.none(), st.integers(), st.text(max_size=5), st.lists(st.text(), max_size=2)),
    ),
)
def test_any_fields_raise_nothing_but_the_peers_error(kind: str, fields: dict[str, object]) -> None:
    with contextlib.suppress(RemoteProtocolError):
        ClientSession().receive(json.dumps({"type": kind} | fields))


@given(contact_samples)
def test_a_server_that_speaks_like_a_client_broke_the_protocol(sample: ContactSample) -> None:
    for ours in (encode_control(HELLO), encode_control(Bye()), sample.encode()):
        session = session_in(State.JOINED)
        with pytest.raises(RemoteProtocolError):
            session.receive(ours)
        assert session.state is State.CLOSED


def test_what_is_said_first_and_last_is_what_a_server_understands() -> None:
    assert decode_client_control(ClientSession.greeting(HELLO)) == HELLO
    assert decode_client_control(ClientSession.farewell()) == Bye()


def mesh_patch(*indices: int) -> Patch:
    near = Neighbourhood.of_units(
        0.0, 0.0, indices, ((0, 0, 0),) * len(indices), (0,) * len(indices)
    )
    return replace(PLANE, geometry=Geometry.MESH, neighbourhood=near)


def test_a_mesh_patch_may_speak_of_every_vertex_that_the_rest_mesh_had_and_no_other() -> None:
    session = session_in(State.JOINED)
    session.receive(wire(REST_MESH))
    heard = session.receive(wire(mesh_patch(0, 1, 2)))
    assert isinstance(heard, Patch)
    assert heard.neighbourhood == mesh_patch(0, 1, 2).neighbourhood
    session.receive(wire(mesh_patch()))
    with pytest.raises(
        RemoteProtocolError, match=r"index of a vertex is 3; expected less than .* 3"
    ):
        session.receive(wire(mesh_patch(0, 3)))
    assert session.state is State.CLOSED


def test_a_mesh_patch_before_the_rest_mesh_breaks_the_protocol() -> None:
    with pytest.raises(RemoteProtocolError, match="expected a rest mesh before it"):
        session_in(State.JOINED).receive(wire(mesh_patch(0)))


def test_a_second_rest_mesh_breaks_the_protocol() -> None:
    session = session_in(State.JOINED)
    assert session.receive(wire(REST_MESH)) == REST_MESH
    with pytest.raises(RemoteProtocolError, match="expected one in each session"):
        session.receive(wire(REST_MESH))
