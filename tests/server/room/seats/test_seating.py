from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.errors import CloseCode, RemoteProtocolError
from cohaptic_server.room.room import Seating

COUNTS = st.integers(0, 20)


@given(st.integers(1, 20), st.none() | COUNTS, COUNTS)
def test_a_seat_is_there_below_both_limits_and_a_refusal_names_the_lower(
    capacity: int, held: int | None, present: int
) -> None:
    seats = Seating(capacity, "users", "; watch")
    if held is not None:
        seats.allow(held, 0)
    limit = capacity if held is None else min(capacity, held)
    if present < limit:
        seats.check(present)
        return
    with pytest.raises(RemoteProtocolError, match=f"at most {limit}.*; watch") as error:
        seats.check(present)
    assert error.value.code is CloseCode.ROOM_FULL


@given(COUNTS, COUNTS, st.lists(COUNTS, max_size=10))
def test_seats_in_use_are_given_back_only_when_somebody_leaves(
    wanted: int, used: int, later: list[int]
) -> None:
    seats = Seating(64, "users")
    seats.allow(wanted, used)
    held = max(wanted, used)
    for present in later:
        present = min(present, held)  # nobody comes without a seat
        left = seats.give_back(present)
        assert max(wanted, present) <= left <= held or left == held
        held = left
