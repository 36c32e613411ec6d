"""The users of the load, where a server does what it should not."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

import load

pytestmark = pytest.mark.live


@given(st.integers(1, 800), st.integers(1, 64))
def test_users_are_spread_evenly_over_as_few_rooms_as_hold_them(users: int, most: int) -> None:
    each = load.spread(users, most)
    assert sum(each) == users
    assert max(each) <= most
    assert max(each) - min(each) <= 1
    assert (len(each) - 1) * most < users
