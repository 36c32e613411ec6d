"""A page before a full room: it watches, waits for a place, and comes in when one is free."""

from __future__ import annotations

import pytest

from tests.browser.conftest import Open, Serve
from tests.browser.visitor import Visitor

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


def rename(visitor: Visitor, name: str) -> None:
    visitor.page.fill(".name", name)
    visitor.page.press(".name", "Tab")
