from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.errors import CloseCode, RemoteProtocolError
from cohaptic_server.room.seats.names import (
    KEPT_FOR,
    REPLACE_AFTER,
    SEAT_KEPT_FOR,
    Claim,
    KeptNames,
    may_replace,
)

claims = st.builds(Claim, st.sampled_from([None, "a" * 16, "b" * 16]), st.sampled_from("xy"))


@given(claims, claims, st.floats(0.0, 1e4))
def test_a_name_in_use_goes_to_its_secret_or_to_silence_at_its_address(
    holder: Claim, other: Claim, silence: float
) -> None:
    may = may_replace(holder, silence, other)
    if holder.key is not None:
        assert may == (other.key == holder.key)
    else:
        assert may == (other.source == holder.source and silence >= REPLACE_AFTER)


@given(claims, claims, st.floats(0.0, 2.0 * KEPT_FOR))
def test_a_kept_name_goes_to_its_owner_or_its_address_until_it_is_free(
    owner: Claim, other: Claim, later: float
) -> None:
    kept = KeptNames()
    kept.keep("ann", owner, 0.0, since=None)
    same = owner.source == other.source or (owner.key is not None and owner.key == other.key)
    if same or later >= KEPT_FOR:
        kept.check("ann", other, later)
        kept.forget("ann", other)
        kept.check("ann", Claim(None, "z"), later)  # it is not kept any more
        return
    with pytest.raises(RemoteProtocolError) as caught:
        kept.check("ann", other, later)
    assert caught.value.code is CloseCode.NAME_TAKEN
    kept.check("bob", other, later)


def test_names_that_are_kept_are_bounded_and_the_newest_win() -> None:
    kept, stranger = KeptNames(), Claim(None, "stranger")
    for number in range(1000):
        kept.keep(f"user{number}", Claim(None, "home"), 0.0, since=None)
    refused = 0
    for number in range(1000):
        try:
            kept.check(f"user{number}", stranger, 1.0)
        except RemoteProtocolError:
            refused += 1
    assert refused == 64
    with pytest.raises(RemoteProtocolError):
        kept.check("user999", stranger, 1.0)


def test_who_fills_the_list_takes_nobody_elses_name_or_seat() -> None:
    kept, stranger = KeptNames(), Claim(None, "stranger")
    kept.keep("victim", Claim(None, "home"), 100.0, since=0.0)
    for number in range(200):
        kept.keep(f"bad{number}", Claim(None, "bad"), 100.0, since=None)
    assert kept.seats(100.0 + 0.9 * SEAT_KEPT_FOR) == 1
    with pytest.raises(RemoteProtocolError):
        kept.check("victim", stranger, 101.0)
    kept.check("bad0", stranger, 101.0)


@given(st.floats(0.0, 100.0), st.floats(0.0, 30.0))
def test_a_seat_is_kept_for_as_long_as_it_was_taken_and_not_for_long(
    taken: float, later: float
) -> None:
    kept = KeptNames()
    kept.keep("ann", Claim(None, "home"), 100.0, since=100.0 - taken)
    limit = min(taken, SEAT_KEPT_FOR)
    if abs(later - limit) > 1e-9:
        assert kept.seats(100.0 + later) == (later < limit)


@given(st.lists(st.sampled_from(["", "one", "two"]), max_size=8), st.sampled_from(["", "one"]))
def test_who_is_back_has_the_seats_of_its_session_and_no_others(lost: list[str], back: str) -> None:
    kept = KeptNames()
    for number, session in enumerate(lost):
        kept.keep(f"user{number}", Claim(None, "home", session), 100.0, since=0.0)
    claim = Claim(None, "elsewhere", back)
    own = lost.count(back) if back else 0
    assert kept.seats_of("another", claim, 100.0) == own
    kept.forget("another", claim)
    assert kept.seats(100.0) == len(lost) - own


def test_one_at_the_same_address_has_no_claim_to_a_name_that_looks_like_a_kept_one() -> None:
    kept, owner = KeptNames(), Claim("a" * 16, "home")
    kept.keep("anna", owner, 0.0, since=None)
    double = "\u0430nna"  # with a Cyrillic letter
    with pytest.raises(RemoteProtocolError):
        kept.check(double, Claim("b" * 16, "home"), 1.0)
    kept.check(double, owner, 1.0)
