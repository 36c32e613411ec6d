"""A page before a full room: it watches, waits for a place, and comes in when one is free."""

from __future__ import annotations

import pytest

from tests.browser.conftest import Open, Serve
from tests.browser.visitor import Look, Visitor

pytestmark = pytest.mark.live


def test_a_page_waits_is_told_its_place_and_comes_in(visitors: Open, serve: Serve) -> None:
    room = serve("--max-users", "1")
    guest = visitors()
    with room.hand("native"):
        guest.visit(room.address)
        room.until(bool, "the hand to be there")
        guest.page.fill(".name", "guest")
        guest.page.click(".touch-button")
        guest.until(lambda: "No place to touch" in guest.notice, "word of the full room")
        assert guest.watches()  # meanwhile, as the notice offers
        guest.page.get_by_role("button", name="Wait for a place").click()
        guest.until(lambda: "place 1 of 1" in guest.text(".dock-hint"), "its place")
        # Who gives up, and asks again, waits again.
        guest.page.click(".touch-button")
        guest.page.click(".touch-button")
        guest.until(lambda: "No place to touch" in guest.notice, "word of the full room")
        guest.page.get_by_role("button", name="Wait for a place").click()
        guest.until(lambda: "place 1 of 1" in guest.text(".dock-hint"), "its place")
    guest.until(lambda: guest.text(".dock-facts") == "in the air", "the hand to be engaged")
    guest.press(right=0.3)
    assert guest.steady_force() > 0.0
    guest.away = True


def test_a_name_is_changed_in_the_queue_and_in_a_full_room_and_neither_place_is_lost(
    visitors: Open, serve: Serve
) -> None:
    room = serve("--max-users", "1")
    wide = Look(1440, 900, engineer=False)
    ann, bob = visitors(wide), visitors(wide)
    ann.visit(room.address)
    ann.take_part("ann")
    bob.visit(room.address)
    bob.page.fill(".name", "bob")
    bob.page.click(".touch-button")
    bob.page.get_by_role("button", name="Wait for a place").click()
    bob.until(lambda: "place 1 of 1" in bob.text(".dock-hint"), "its place")
    # Longer than a page waits for any word: the place is told again meanwhile.
    bob.page.wait_for_timeout(11_000)
    assert "place 1 of 1" in bob.text(".dock-hint")
    rename(bob, "bob of elsewhere")
    rename(ann, "ann of somewhere")
    ann.until(lambda: ann.force_of("ann of somewhere (you)") == 0.0, "the new name")
    bob.until(lambda: bob.force_of("ann of somewhere") == 0.0, "the new name of the other")
    assert "place 1 of 1" in bob.text(".dock-hint")
    rename(bob, "ann of somewhere")
    bob.until(lambda: "You keep your name" in bob.notice, "word of the name that is taken")
    assert bob.page.input_value(".name") == "bob of elsewhere"
    ann.page.click(".touch-button")
    bob.until(lambda: bob.force_of("bob of elsewhere (you)") == 0.0, "the other to come in")
    room.until(lambda users: len(users) == 1, "the first to be gone")


def rename(visitor: Visitor, name: str) -> None:
    visitor.page.fill(".name", name)
    visitor.page.press(".name", "Tab")
