from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from cohaptic_server.access.keys import OPEN, Grants

NAMES = st.text("ab1-", min_size=1, max_size=4).filter(lambda name: name[0] != "-")


def test_nothing_is_allowed_that_is_not_said() -> None:
    grants = Grants(room="main")
    allowed = [value for name, value in grants if name not in ("room", "max_force")]
    assert allowed == [False] * 7


@given(NAMES, NAMES)
def test_a_name_is_for_that_room_alone_and_a_prefix_for_all_that_begin_so(
    name: str, other: str
) -> None:
    assert Grants(room=name).hold_in(name)
    assert Grants(room=name).hold_in(other) == (name == other)
    assert Grants(room=f"{name}*").hold_in(other) == other.startswith(name)
    assert Grants(room="*").hold_in(name)


@pytest.mark.parametrize("room", ["", "a b", "*lab", "l*b", "../etc", "-x", "lab\n", "x" * 66, "ä"])
def test_what_is_no_name_of_a_room_is_refused(room: str) -> None:
    with pytest.raises(ValidationError):
        Grants(room=room)


@pytest.mark.parametrize(
    "said",
    [
        {"room": "main", "maxforce": 1.0},  # a slip of the pen would be no limit
        {"room": "main", "maxForce": -1.0},
        {"room": "main", "maxForce": 101.0},
        {"room": "main", "maxForce": float("nan")},
        {"room": "main", "maxForce": "1"},
        {"room": "main", "canTouch": "true"},
        {"room": "main", "canTouch": 1},
        {"canTouch": True},
    ],
)
def test_a_grant_that_is_not_known_or_not_what_it_should_be_is_refused(
    said: dict[str, object],
) -> None:
    with pytest.raises(ValidationError):
        Grants.model_validate(said)


def test_names_on_the_wire_are_those_of_the_page() -> None:
    written = Grants(room="lab-*", room_join=True, can_inject_latency=True, max_force=2.0)
    assert written.model_dump(by_alias=True, exclude_defaults=True) == {
        "room": "lab-*",
        "roomJoin": True,
        "canInjectLatency": True,
        "maxForce": 2.0,
    }


def test_an_open_room_has_no_administrator() -> None:
    assert not OPEN.room_admin
    assert not OPEN.room_create
    assert not OPEN.room_record
