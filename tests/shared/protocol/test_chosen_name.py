# ruff: noqa: RUF001
from __future__ import annotations

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.errors import RemoteProtocolError
from cohaptic.protocol.control.message import tidy_name
from cohaptic.protocol.messages import Hello, decode_client_control
from cohaptic.protocol.version import PROTOCOL_VERSION
from cohaptic.protocol.watch_messages import decode_client_message


@given(st.text(max_size=40))
def test_a_name_is_tidy_or_refused_and_tidy_for_good(name: str) -> None:
    try:
        tidy = tidy_name(name)
    except ValueError:
        return
    assert tidy == tidy.strip() == tidy_name(tidy)
    assert 1 <= len(tidy) <= 32
    assert tidy.isprintable() or not tidy.isascii()


@pytest.mark.parametrize(
    ("written", "taken"),
    [
        ("ann ", "ann"),
        ("\u00a0ann", "ann"),
        ("ann\u3000 b", "ann b"),
        ("ａｎｎ", "ann"),
        ("ann\ufe0f", "ann"),
        ("Zoë", "Zoë"),
        ("Zoe\u0308", "Zoë"),
        ("李 明", "李 明"),
        ("<b>ann</b>", "<b>ann</b>"),
        ("\U0001f40c", "\U0001f40c"),
    ],
)
def test_blanks_and_forms_of_letters_are_made_plain(written: str, taken: str) -> None:
    assert tidy_name(written) == taken


@pytest.mark.parametrize(
    "unseen",
    [
        *"\u200b\u200c\u200d\u2060\ufeff\u00ad\u202e\u202a\u2066\u200f",
        *"\u3164\uffa0\u115f\u2800\u034f\u180e\ue000\U000e0041\U000e0020",
        *"\u2065\ufff0\ufff8\U00016fe4\U0001d159",
    ],
)
@pytest.mark.parametrize("where", ["{}ann", "a{}nn", "ann{}", "{}"])
def test_what_nobody_sees_is_refused_and_named(unseen: str, where: str) -> None:
    name = where.format(unseen)
    for text in (
        json.dumps({"type": "hello", "protocol": PROTOCOL_VERSION, "name": name}),
        json.dumps({"type": "set_name", "name": name}),
        json.dumps({"type": "present", "name": name}),
    ):
        with pytest.raises(RemoteProtocolError, match=r"U\+[0-9A-F]{4,5}") as caught:
            decode_client_message(text)
        assert str(caught.value).isprintable()


@pytest.mark.parametrize("name", [" ", "\u00a0\u3000", "\ufdfa" * 3, "\ufe0f", ""])
def test_a_name_has_from_1_to_32_characters_once_it_is_tidy(name: str) -> None:
    with pytest.raises(RemoteProtocolError):
        decode_client_control(
            json.dumps({"type": "hello", "protocol": PROTOCOL_VERSION, "name": name})
        )


def test_a_client_sends_its_name_in_normal_form() -> None:
    assert Hello(protocol=5, name=" ａｎｎ ").name == "ann"
