from __future__ import annotations

import pytest

from cohaptic_server.access.admission import ANYBODY, Guest
from cohaptic_server.access.denied import Denied
from cohaptic_server.access.remembered import MOST_REMOVED, Removal
from cohaptic_server.room.removed import KICKED_FOR, Removed


def guest(session: str, invitation: str = "i", since: float = 0.0) -> Guest:
    return Guest(sub="a", session=session, invitation=invitation, since=since)


def test_the_list_is_bounded_and_the_oldest_is_forgotten_first() -> None:
    removed = Removed()
    for i in range(2 * MOST_REMOVED):
        removed.add(guest(f"s{i}", f"i{i}"), f"n{i}", "", 0.0, 0.0, ban=True)
    assert len(removed) == MOST_REMOVED
    removed.check(guest("s0", "i0"), "n0", "", 0.0)
    with pytest.raises(Denied, match="banned"):
        removed.check(guest(f"s{2 * MOST_REMOVED - 1}"), "", "", 0.0)


def test_however_many_are_kicked_a_ban_holds() -> None:
    removed = Removed()
    removed.add(guest("bad", "b"), "bad", "", 0.0, 0.0, ban=True)
    for i in range(2 * MOST_REMOVED):
        removed.add(guest(f"s{i}", f"i{i}"), f"n{i}", "", 0.0, 0.0, ban=False)
    assert len(removed) == MOST_REMOVED
    with pytest.raises(Denied, match="banned"):
        removed.check(guest("bad"), "", "", 1.0)
    with pytest.raises(Denied, match="come back"):
        removed.check(guest(f"s{2 * MOST_REMOVED - 1}"), "", "", 1.0)


def test_who_was_kicked_is_told_how_long_and_forgotten_after_that() -> None:
    removed = Removed()
    removed.add(guest("s"), "n", "", 0.0, 0.0, ban=False)
    with pytest.raises(Denied, match="come back in 100 s"):
        removed.check(guest("s"), "", "", KICKED_FOR - 100.0)
    removed.check(guest("s"), "n", "", KICKED_FOR)
    removed.add(guest("t"), "m", "", KICKED_FOR, 0.0, ban=False)
    assert len(removed) == 1


def test_one_without_a_token_is_known_by_its_address_and_one_with_a_token_is_not() -> None:
    removed = Removed()
    removed.add(ANYBODY, "n", "1.2.3.4", 0.0, 0.0, ban=False)
    with pytest.raises(Denied):
        removed.check(ANYBODY, "other", "1.2.3.4", 0.0)
    removed.check(ANYBODY, "other", "1.2.3.5", 0.0)
    removed.check(guest("s"), "other", "1.2.3.4", 0.0)


def test_what_one_process_keeps_holds_in_the_next_whatever_the_wall_clock_does() -> None:
    kept: list[Removal] = []
    first = Removed(kept.append)
    first.add(guest("kicked"), "k", "", 50.0, 1000.0, ban=False)
    first.add(guest("banned", "j"), "b", "", 50.0, 1000.0, ban=True)
    # Its monotonic clock begins elsewhere; the wall's is 100 s on, was set back, or set forward.
    for wall, left in ((1100.0, KICKED_FOR - 100.0), (-1e9, KICKED_FOR), (1e9, 0.0)):
        then = Removed()
        for removal in kept:
            then.recall(removal, 7.0, wall)
        with pytest.raises(Denied, match="banned"):
            then.check(guest("banned", "j"), "", "", 7.0 + 1e9)
        then.check(guest("kicked"), "", "", 7.0 + left)
        if left > 0.0:
            with pytest.raises(Denied, match=f"come back in {left - 1.0:.0f} s"):
                then.check(guest("kicked"), "", "", 8.0)
    # A step while it runs changes nothing for it.
    with pytest.raises(Denied, match="come back in 250 s"):
        first.check(guest("kicked"), "", "", 100.0)
