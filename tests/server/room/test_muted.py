from __future__ import annotations

from cohaptic_server.room.member import MAX_MUTED, Muted
from cohaptic_server.room.seats.names import Claim


def test_one_is_known_by_its_name_its_secret_or_its_session_and_not_by_its_address() -> None:
    muted = Muted()
    muted.add("a", Claim("k" * 32, "home", "s"))
    assert muted.holds("a", Claim(None, "elsewhere"))
    assert muted.holds("b", Claim("k" * 32, "elsewhere"))
    assert muted.holds("b", Claim(None, "elsewhere", "s"))
    assert not muted.holds("b", Claim(None, "home"))
    muted.add("c", Claim(None, "home"))
    assert not muted.holds("d", Claim(None, "home"))


def test_who_is_muted_no_more_is_so_by_no_name() -> None:
    muted = Muted()
    claim = Claim("k" * 32, "home")
    muted.add("a", claim)
    muted.add("b", claim)
    assert len(muted) == 1
    muted.take_out("b", claim)
    assert not muted.holds("a", claim)


def test_the_list_is_bounded_and_the_oldest_is_forgotten_first() -> None:
    muted = Muted()
    for i in range(2 * MAX_MUTED):
        muted.add(str(i), Claim(None, ""))
    assert len(muted) == MAX_MUTED
    assert not muted.holds("0", Claim(None, ""))
