from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.errors import SettingError
from cohaptic.protocol.messages import Hello, decode_client_control, encode_control
from cohaptic.protocol.version import PROTOCOL_VERSION
from cohaptic_client.devices.kind import DeviceChoice
from cohaptic_client.settings import ClientSettings


def settings(**changes: Any) -> ClientSettings:
    values: dict[str, Any] = {"url": "ws://127.0.0.1:8765", "name": "left"}
    return ClientSettings(**(values | changes))


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("max_force", 0.0, "max force is 0.0 N; it must be above 0, at most 100 N"),
        ("max_force", -1.0, "max force"),
        ("max_force", 101.0, "max force"),
        ("max_force", math.nan, "max force"),
        ("name", "", "name is ''; it must be 1 to 32 printable characters"),
        ("name", "x" * 33, "name"),
        ("name", "a\nb", "name"),
        ("name", "\x1b[31m", "name"),
        ("name", "\udcff", "name"),
        ("name", " ", "name"),
        ("name", "\u3164", "U+1160"),
        ("name", "\ufdfa" * 3, "this one 54"),
        ("duration", 0.0, "duration is 0.0 s; it must be above 0"),
        ("duration", math.nan, "duration"),
        ("patience", -1.0, "wait is -1.0 s; it must be 0 or more"),
        ("patience", math.nan, "wait"),
        ("loop_hz", 10.0, "loop rate is 10.0 Hz; it must be from 500 to 4000 Hz"),
        ("loop_hz", math.nan, "loop rate"),
        (
            "device",
            DeviceChoice("nonsense"),
            "device is 'nonsense'; it must be one of: simulated, ",
        ),
    ],
)
def test_absurd_settings_are_refused_before_anything_starts(
    name: str, value: object, words: str
) -> None:
    with pytest.raises(SettingError) as caught:
        settings(**{name: value})
    assert words in str(caught.value)


@given(st.text(max_size=40), st.floats())
def test_what_is_accepted_can_be_said_to_a_server(name: str, max_force: float) -> None:
    try:
        accepted = settings(name=name, max_force=max_force)
    except SettingError:
        return
    hello = Hello(protocol=PROTOCOL_VERSION, name=accepted.name, max_force=accepted.max_force)
    assert decode_client_control(encode_control(hello)) == hello
