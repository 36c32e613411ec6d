"""Who is alone on the page: a second window of the room, and a partner that is simulated."""

from __future__ import annotations

from pathlib import Path

import pytest

from cohaptic.clock import SystemClock
from cohaptic_server.access.keys import Grants, KeyRing
from cohaptic_server.access.tokens import Claims, sign
from cohaptic_server.credentials.key_file import new_key, save_keys
from tests.browser.conftest import Open, Serve
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


def test_an_invitation_brings_in_a_second_window_and_a_partner_beside_its_visitor(
    visitors: Open, serve: Serve, tmp_path: Path
) -> None:
    link = invited(serve, tmp_path)
    ann = visitors(DESKTOP)
    ann.visit(link)
    ann.take_part("ann")
    with ann.page.context.expect_page() as opened:
        press(ann, "Open a second window")
    second = Visitor(opened.value)
    second.until(second.watches, "the second window to watch")
    assert "token" not in second.page.url
    # A session has one seat: the partner begins its own, and takes the visitor's from nobody.
    press(ann, "Bring a partner")
    ann.until(lambda: ann.force_of(PARTNER) > 0.5, "the partner to press")
    second.take_part("bob")
    ann.until(lambda: "bob" in ann.text(".cards"), "the second visitor")
    # On a busy machine the page may just have no word from the server.
    ann.until(lambda: ann.doing() == "in the air", "the hand to have kept its place")
    assert ann.notice == ""


def invited(serve: Serve, folder: Path, *options: str) -> str:
    """Link of an invitation to a server that asks for one."""
    key, clock = new_key(), SystemClock()
    save_keys(folder / "keys", KeyRing((key,)), replace=False)
    room = serve("--keys", str(folder / "keys"), *options)
    now = clock.now() + clock.to_wall()
    allowed = Grants(room="main", room_join=True, can_view=True, can_touch=True)
    claims = Claims(sub="guest", jti="invitation", iat=now, exp=now + 600.0, haptic=allowed)
    return f"{room.address}#token={sign(claims, key)}"
