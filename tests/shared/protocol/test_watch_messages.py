from __future__ import annotations

import contextlib
import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.errors import CloseCode, RemoteProtocolError
from cohaptic.protocol.messages import BodyInfo, RoomUser, encode_control
from cohaptic.protocol.version import PROTOCOL_VERSION
from cohaptic.protocol.watch_messages import (
    MAX_WATCHING_TEXT,
    SetLatency,
    SetView,
    Watch,
    Watching,
    decode_client_message,
    decode_watch_control,
)
from tests.shared.protocol.test_messages import anything


@given(st.text(max_size=300))
def test_any_text_gives_a_message_or_the_peers_error(text: str) -> None:
    for decode in (decode_client_message, decode_watch_control):
        with contextlib.suppress(RemoteProtocolError):
            decode(text)


@given(
    st.dictionaries(
        st.sampled_from(
            [
                "protocol",
                "encoding",
                "rate",
                "user",
                "delay",
                "jitter",
                "users",
                "company",
                "name",
                "open",
                "azimuth",
                "elevation",
                "distance",
                "point",
                "watching",
                "followers",
                "reason",
            ]
        ),
        anything,
    ),
    st.sampled_from(
        [
            "watch",
            "set_view",
            "set_latency",
            "watching",
            "latency",
            "present",
            "follow",
            "aim",
            "point",
            "company",
            "aimed",
            "pointed",
            "declined",
        ]
    ),
)
def test_any_fields_give_a_message_or_the_peers_error(fields: dict[str, Any], kind: str) -> None:
    text = json.dumps({"type": kind} | fields)
    for decode in (decode_client_message, decode_watch_control):
        with contextlib.suppress(RemoteProtocolError):
            decode(text)


@given(
    st.builds(
        Watch,
        protocol=st.just(PROTOCOL_VERSION),
        encoding=st.sampled_from(["frames", "forces"]),
        rate=st.floats(1.0, 60.0),
    )
    | st.builds(SetView, encoding=st.sampled_from(["frames", "forces"]), rate=st.floats(1.0, 60.0))
    | st.builds(
        SetLatency,
        user=st.integers(1, 2**32 - 1),
        delay=st.floats(0.0, 1.0),
        jitter=st.floats(0.0, 0.5),
    )
)
def test_comes_back_as_it_was(message: Watch | SetView | SetLatency) -> None:
    assert decode_client_message(encode_control(message)) == message


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"type": "watch", "protocol": PROTOCOL_VERSION, "rate": 61}, "rate is 61"),
        ({"type": "watch", "protocol": PROTOCOL_VERSION, "rate": 0.5}, "rate is 0.5"),
        (
            {"type": "watch", "protocol": PROTOCOL_VERSION, "encoding": "video"},
            "encoding is 'video'",
        ),
        ({"type": "watch", "protocol": PROTOCOL_VERSION, "name": "eve"}, "name is 'eve'"),
        ({"type": "set_latency", "user": 1, "delay": 1.01}, "delay is 1.01"),
        ({"type": "set_latency", "user": 1, "delay": 0, "jitter": 0.6}, "jitter is 0.6"),
        ({"type": "set_latency", "user": 0, "delay": 0}, "user is 0"),
    ],
)
def test_a_value_out_of_its_limits_is_named(fields: dict[str, Any], message: str) -> None:
    with pytest.raises(RemoteProtocolError, match=message):
        decode_client_message(json.dumps(fields))


@pytest.mark.parametrize("theirs", [0, 1, 99, "one", None])
def test_another_version_is_named_whatever_else_changed(theirs: object) -> None:
    text = json.dumps({"type": "watch", "protocol": theirs})
    with pytest.raises(RemoteProtocolError, match=f"protocol version is {theirs!r}") as caught:
        decode_client_message(text)
    assert caught.value.code is CloseCode.WRONG_VERSION


def test_the_fullest_room_fits() -> None:
    # A quotation mark and a character of four bytes are the longest in JSON and on the wire.
    for letter in ('"', "\U0001f9a9"):
        users = tuple(RoomUser(user=2**32 - i, name=letter * 32) for i in range(1, 65))
        body = BodyInfo(name="x" * 200, center=(0.1, 0.1, 0.1), radius=0.1, contact_radius=0.02)
        watching = Watching(
            simulation_period=1 / 60,
            body=body,
            model="0" * 32,
            users=users,
            allow_latency=False,
            allow_fixed_gains=False,
        )
        text = encode_control(watching)
        assert len(text) <= MAX_WATCHING_TEXT
        assert decode_watch_control(text) == watching
