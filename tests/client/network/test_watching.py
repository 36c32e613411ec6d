"""Who is in a room, as a watcher hears it."""

from __future__ import annotations

from typing import Any, cast

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.errors import RemoteProtocolError
from cohaptic.protocol.messages import UserJoined, UserLeft, encode_control
from cohaptic.protocol.scene_users import MAX_USERS
from cohaptic.testing import ManualClock
from cohaptic_client import ClientSettings
from cohaptic_client.network.watching import Watcher

SETTINGS = ClientSettings("ws://127.0.0.1:1", "view")


def hear(watcher: Watcher, message: UserJoined | UserLeft) -> None:
    cast(Any, watcher)._hear(encode_control(message))  # as its link does


@given(st.lists(st.tuples(st.integers(1, 4), st.sampled_from(["ann", "bob", ""]))))
def test_the_names_are_the_newest_of_those_who_have_not_left(events: list[tuple[int, str]]) -> None:
    watcher, names = Watcher(SETTINGS, ManualClock()), dict[int, str]()
    for user, name in events:
        if name:
            hear(watcher, UserJoined(user=user, name=name))
            names[user] = name
        else:
            hear(watcher, UserLeft(user=user, name="who", reason="bye"))
            names.pop(user, None)
        assert watcher.names == names


def test_a_server_cannot_fill_the_memory_with_names() -> None:
    watcher = Watcher(SETTINGS, ManualClock())
    for user in range(1, MAX_USERS + 1):
        hear(watcher, UserJoined(user=user, name="ann"))
    hear(watcher, UserJoined(user=MAX_USERS, name="bob"))
    with pytest.raises(RemoteProtocolError, match=f"at most {MAX_USERS}"):
        hear(watcher, UserJoined(user=MAX_USERS + 1, name="ann"))
