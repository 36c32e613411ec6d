from __future__ import annotations

import contextlib
import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.errors import CloseCode, RemoteProtocolError
from cohaptic.protocol.messages import (
    MAX_PERIOD,
    MAX_TEXT,
    MIN_PERIOD,
    Hello,
    Welcome,
    decode_client_control,
    decode_server_control,
    encode_control,
)
from cohaptic.protocol.version import PROTOCOL_VERSION

anything = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=20),
    lambda inner: (
        st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=4)
    ),
    max_leaves=12,
)


def hello(**changes: Any) -> str:
    return json.dumps({"type": "hello", "protocol": PROTOCOL_VERSION, "name": "left"} | changes)


@given(st.text(max_size=300))
def test_any_text_gives_a_message_or_the_peers_error(text: str) -> None:
    for decode in (decode_client_control, decode_server_control):
        with contextlib.suppress(RemoteProtocolError):
            decode(text)


@given(
    st.dictionaries(st.sampled_from(["name", "protocol", "user", "body", "law"]), anything),
    st.sampled_from(["hello", "bye", "welcome", "error", "user_left"]),
)
def test_any_fields_give_a_message_or_the_peers_error(fields: dict[str, Any], kind: str) -> None:
    text = json.dumps({"type": kind} | fields)
    for decode in (decode_client_control, decode_server_control):
        with contextlib.suppress(RemoteProtocolError):
            decode(text)


def test_an_error_never_repeats_more_than_a_line_of_the_message() -> None:
    with pytest.raises(RemoteProtocolError) as caught:
        decode_client_control(hello(law="x" * 3000))
    assert len(str(caught.value)) < 300


@given(st.text(alphabet=st.characters(categories=["L", "N", "P", "S"]), min_size=1, max_size=32))
def test_printable_names_pass(name: str) -> None:
    message = Hello(protocol=PROTOCOL_VERSION, name=name)
    assert decode_client_control(encode_control(message)) == message


@pytest.mark.parametrize("name", ["", "x" * 33, "a\nb", "\x1b[31m", "\u2028"])
def test_names_that_would_spoil_a_terminal_do_not(name: str) -> None:
    with pytest.raises(RemoteProtocolError, match="name is"):
        decode_client_control(hello(name=name))


@pytest.mark.parametrize("theirs", [0, 1, 99, "one", None])
def test_another_version_is_named_whatever_else_changed(theirs: object) -> None:
    with pytest.raises(RemoteProtocolError, match=f"protocol version is {theirs!r}") as caught:
        decode_client_control(hello(protocol=theirs))
    assert caught.value.code is CloseCode.WRONG_VERSION


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("{", "Invalid JSON"),
        ('{"type": "dance"}', "dance"),
        ("{}", "type"),
        (hello(law="magic"), "magic"),
        (hello(max_stiffness=-1), "max_stiffness"),
        (hello(surprise=1), "surprise"),
        (hello(damping_budget=-1), "damping_budget"),
        (hello(damping_budget=2000), "damping_budget"),
        (hello(capabilities={"device": ""}), "capabilities.device"),
        (hello(capabilities={"device": "x", "force_axes": 4}), "capabilities.force_axes"),
        (hello(capabilities={"device": "x", "max_force": -1}), "capabilities.max_force"),
        (hello(capabilities={"device": "x", "rate": 0}), "capabilities.rate"),
        (hello(capabilities={"device": "x", "colour": 1}), "capabilities.colour"),
        ("x" * (MAX_TEXT + 1), str(MAX_TEXT)),
    ],
)
def test_the_error_names_the_field_at_fault(text: str, words: str) -> None:
    with pytest.raises(RemoteProtocolError) as caught:
        decode_client_control(text)
    assert words in str(caught.value)


BODY = {"name": "balloon", "center": [0, 0, 0], "radius": 0.1, "contact_radius": 0.02}


def welcome(body: dict[str, object] | None = None, **changes: object) -> str:
    fields: dict[str, object] = {"type": "welcome", "user": 1, "name": "left", "users": []}
    usual: dict[str, object] = {"simulation_period": 0.02, "body": BODY | (body or {})}
    return json.dumps(fields | usual | changes)


@pytest.mark.parametrize("period", [MIN_PERIOD, 1.0 / 60.0, MAX_PERIOD])
def test_a_welcome_names_a_rate_that_a_server_may_have(period: float) -> None:
    message = decode_server_control(welcome(simulation_period=period))
    assert isinstance(message, Welcome)
    assert message.simulation_period == period


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (welcome(simulation_period=0.0), "simulation_period"),
        (welcome(simulation_period=0.9 * MIN_PERIOD), "simulation_period"),
        (welcome(simulation_period=1.1 * MAX_PERIOD), "simulation_period"),
        (welcome({"center": [0, 0, 11.0]}), "center"),
        (welcome({"radius": 0.0}), "radius"),
        (welcome({"radius": 11.0}), "radius"),
        (welcome({"contact_radius": 0.0}), "contact_radius"),
        (welcome({"contact_radius": 11.0}), "contact_radius"),
    ],
)
def test_a_client_believes_no_other_number(text: str, words: str) -> None:
    """One that did would ramp its surface in no time or for ever, or put its device elsewhere."""
    with pytest.raises(RemoteProtocolError) as caught:
        decode_server_control(text)
    assert words in str(caught.value)
