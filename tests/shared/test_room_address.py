from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.errors import SettingError
from cohaptic.room_address import is_room_name, room_path, room_url, split_path

LETTERS = "abcz019-_"
NAMES = st.text(LETTERS, min_size=1, max_size=64).filter(is_room_name)


@given(NAMES, st.sampled_from(["", "/", "/assets/x.js"]), st.sampled_from(["", "?a=/r/b", "#x"]))
def test_the_room_of_a_path_is_found_with_what_is_behind_it(
    name: str, rest: str, more: str
) -> None:
    assert split_path(room_path(name) + rest + more) == (name, rest)


@given(st.text(max_size=50))
def test_a_path_elsewhere_has_no_room(path: str) -> None:
    if not path.startswith("/r/"):
        assert split_path(path)[0] is None


@given(NAMES, st.sampled_from(["ws://a:1", "wss://a.b/proxy", "ws://[::1]:8765/"]))
def test_the_address_of_a_room_names_it_and_is_left_as_it_is_when_it_does(
    name: str, url: str
) -> None:
    address = room_url(url, name)
    assert address.endswith(room_path(name))
    assert "//r" not in address
    assert room_url(address, name) == room_url(address, "") == address
    assert room_url(address + "/", name) == address + "/"


@pytest.mark.parametrize(
    "name", ["", "A", "a__b", "-a", "a-", "_", "a/b", "a b", "é", "a" * 65, "a\n", "a.b", ".."]
)
def test_names_that_would_need_quotes_are_none(name: str) -> None:
    assert not is_room_name(name)


def test_what_contradicts_itself_is_refused() -> None:
    with pytest.raises(SettingError, match="--room is b; it must be a, as the address"):
        room_url("ws://a:1/r/a", "b")
    with pytest.raises(SettingError, match="--room is 'B'"):
        room_url("ws://a:1", "B")
