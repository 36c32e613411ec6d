"""Who is alone on the page: a second window of the room, and a partner that is simulated."""

from __future__ import annotations

import pytest

from tests.browser.conftest import Open
from tests.browser.room import Room
from tests.browser.test_share import picture
from tests.browser.visitor import DESKTOP, Look, Visitor

pytestmark = pytest.mark.live

TABLET = Look(820, 1180, engineer=False)
LOOKS = [Look(390, 844, phone=True, engineer=False), TABLET, Look(1440, 900, engineer=False)]
PARTNER = "simulated partner"


def panel(visitor: Visitor) -> None:
    handle = visitor.page.locator(".sheet-handle")
    if handle.is_visible():
        handle.click()


def press(visitor: Visitor, words: str) -> None:
    visitor.page.locator(".panel .button", has_text=words).click()


@pytest.mark.parametrize("look", LOOKS, ids=[f"{look.width}" for look in LOOKS])
def test_who_is_alone_brings_a_partner_and_sends_it_away_again(
    visitors: Open, room: Room, look: Look
) -> None:
    ann = visitors(look)
    ann.visit(room.address)
    panel(ann)
    ann.until(lambda: "Bring a partner" in ann.words(), "the offer")
    picture(ann, "alone")
    press(ann, "Bring a partner")
    there = room.until(lambda users: any(any(u.force) for u in users.values()), "it to press")
    assert len(there) == 1
    ann.until(lambda: ann.force_of(PARTNER) > 0.5, "its force to be shown")
    assert "Your partner is simulated" in ann.words()
    picture(ann, "partner")
    press(ann, "Send the partner away")
    room.until(lambda users: users == {}, "it to be gone")
    ann.until(lambda: "Bring a partner" in ann.words(), "the offer again")
    # The page takes it along.
    press(ann, "Bring a partner")
    room.until(lambda users: len(users) == 1, "the partner again")
    ann.page.goto("about:blank")
    room.until(lambda users: users == {}, "it to have left with the page")


def test_a_partner_presses_so_that_the_visitor_feels_it(visitors: Open, room: Room) -> None:
    ann = visitors(DESKTOP)
    ann.visit(room.address)
    ann.take_part("ann")
    ann.press(right=-0.3)
    alone = ann.steady_force()
    ann.until(lambda: "Nobody else is here" in ann.words(), "the words")
    # A button has the pointer that would press: the keyboard presses this one.
    ann.page.locator(".panel .button", has_text="Bring a partner").evaluate("(b) => b.click()")
    ann.until(lambda: abs(ann.from_others) > 0.05, "the partner to be felt")
    assert ann.steady_force() != pytest.approx(alone, abs=0.03)
    ann.release()
