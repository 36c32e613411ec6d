from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.errors import SettingError
from cohaptic.room_address import base_path, below, is_room_name, room_path, room_url, split_path

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


@given(
    NAMES,
    st.sampled_from(["/haptics", "/a/b.c", "/r2/x", "/R"]),
    st.sampled_from(["", "/", "/x?a"]),
)
def test_a_room_below_a_path_is_found_with_that_path_and_without_it(
    name: str, base: str, rest: str
) -> None:
    inner = room_path(name) + rest
    assert below(base + inner, base) == below(inner, base) == inner
    assert room_url(f"ws://a:1{base}", name) == f"ws://a:1{base}/r/{name}"
    assert base_path(f"{base}/") == base_path(base) == base
    # What only begins like it is not below it.
    assert below(f"{base}x{inner}", base) == f"{base}x{inner}"


@pytest.mark.parametrize(
    "said",
    [
        "haptics",
        "//haptics",
        "/a//b",
        "/r",
        "/a/r",
        "/r/a",
        "/../a",
        "/a/.",
        "/a b",
        "/a?b",
        "/a#b",
        "/%61",
        "/é",
        "https://lab.example/a",
        "/" + "a" * 200,
        "/a\n",
    ],
)
def test_a_path_that_cannot_be_told_from_an_address_is_refused(said: str) -> None:
    with pytest.raises(SettingError, match=r"--base-path is .*; it must be a path of letters"):
        base_path(said)
