from __future__ import annotations

import json
from dataclasses import asdict

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.errors import SettingError
from cohaptic_client.devices.device import DeviceInfo
from cohaptic_client.devices.kind import (
    DeviceChoice,
    DeviceConfig,
    DeviceKind,
    split_choice,
)
from cohaptic_client.devices.simulated import SimulatedDevice

INFO = DeviceInfo("arm", max_force=3.0, max_stiffness=500.0)
words = st.text(st.characters(exclude_characters=",=", codec="utf-8"), min_size=1, max_size=12)


def info_of(choice: DeviceChoice) -> DeviceInfo:
    choice.number("gain", 1.0, 0.0, 2.0, "A")
    choice.one_of("side", ("left", "right"), "left")
    return INFO


def no_opening(config: DeviceConfig) -> SimulatedDevice:
    raise NotImplementedError


ARM = DeviceKind(
    "arm", "an arm", (("id", "which"), ("gain", "A"), ("side", "of it")), info_of, no_opening
)


def read(text: str, kind: DeviceKind = ARM) -> DeviceChoice:
    name, options = split_choice(text)
    assert name == kind.name
    return kind.choice(options)


@given(st.dictionaries(st.sampled_from(["id", "path"]), words))
def test_what_a_choice_shows_is_read_as_the_same_choice(options: dict[str, str]) -> None:
    choice = DeviceChoice("arm", tuple(options.items()))
    name, read_back = split_choice(str(choice))
    assert DeviceChoice(name, tuple(read_back)) == choice


@given(words, st.lists(st.tuples(words, words), max_size=3))
def test_it_survives_the_way_to_the_loops_process(
    name: str, options: list[tuple[str, str]]
) -> None:
    choice = DeviceChoice(name, tuple(options))
    assert DeviceChoice.from_dict(json.loads(json.dumps(asdict(choice)))) == choice


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("arm:speed=1", "option of arm is 'speed'; it must be one of: id, gain, side"),
        ("arm:a,id=b", "option of arm is 'id'; it must be given once"),
        ("arm:id=a,b", "option of a device is 'b'; it must be KEY=VALUE"),
        ("arm:id=", "option of a device is 'id='; it must be KEY=VALUE"),
        ("arm:,", "option of a device is ''; it must be KEY=VALUE"),
        ("arm:gain=3", "arm:gain is 3; it must be a number from 0 to 2 A"),
        ("arm:gain=nan", "arm:gain is nan; it must be a number from 0 to 2 A"),
        ("arm:gain=much", "arm:gain is 'much'; it must be a number from 0 to 2 A"),
        ("arm:side=top", "arm:side is 'top'; it must be one of: left, right"),
    ],
)
def test_what_is_wrong_is_named_with_what_exists(text: str, sentence: str) -> None:
    with pytest.raises(SettingError) as caught:
        read(text)
    assert str(caught.value) == sentence


@given(st.text(max_size=60))
def test_any_text_is_a_choice_or_one_sentence(text: str) -> None:
    try:
        name, options = split_choice(text)
    except SettingError:
        return
    assert ":" not in name
    assert all(value for _, value in options)
