"""Both sides of who follows whom say the same, whatever is said in any order."""

from __future__ import annotations

from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from cohaptic_server.room.company.shared_views import Follows, Visitor

PAGES, USERS = 4, 3
SAID = st.tuples(
    st.sampled_from(["follow", "hand", "leave"]), st.integers(0, PAGES - 1), st.integers(0, USERS)
)


def page() -> Visitor:
    nobody: Any = None  # neither its session nor its mailbox is spoken to
    return Visitor(nobody, nobody)


@given(st.lists(SAID, max_size=40))
def test_who_follows_and_who_speaks_for_a_hand_is_the_same_from_either_side(
    said: list[tuple[str, int, int]],
) -> None:
    follows, pages = Follows(), [page() for _ in range(PAGES)]
    for what, k, user in said:
        if what == "follow":
            follows.follow(pages[k], user)
        elif what == "hand":
            spoke = [one for one in pages if user and one.user == user and one is not pages[k]]
            other = follows.take_hand(pages[k], user)
            assert ([other] if other else []) == spoke
        else:
            follows.leave(pages[k])
        for number in range(1, USERS + 1):
            followers = [one for one in pages if one.following == number]
            assert set(follows.of(number)) == set(followers)
            assert follows.count(number) == len(followers)
            assert (number in follows.users) == bool(followers)
            speaks = [one for one in pages if one.user == number]
            page_of = follows.page(number)
            assert ([page_of] if page_of else []) == speaks
        assert set(follows.pages) == {one for one in pages if one.user}
        assert follows.of(0) == ()
