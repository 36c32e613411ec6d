"""Who administers a room does so in the page, by mouse or keys; who it is done to is told."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest

from cohaptic.clock import SystemClock
from cohaptic_server.access.keys import Grants, KeyRing
from cohaptic_server.access.tokens import Claims, sign
from cohaptic_server.credentials.key_file import new_key, save_keys
from tests.browser.conftest import Open, Serve
from tests.browser.visitor import DESKTOP, Visitor

pytestmark = pytest.mark.live


# Whether a button was pressed while it asked.
_NOTES_SURE = """() => {
  window.sure = false;
  addEventListener("click", ({ target }) => {
    window.sure ||= target.ariaLabel === "Ban for good? guest";
  }, true);
}"""


def given(admin: Visitor) -> float:
    """Force of the only guest that the object gets, as an administrator sees it [N].

    It is nan while a busy server is silent.
    """
    said = admin.text(".card-force").removesuffix(" N")
    return math.nan if said == "\u2013" else float(said or 0.0)


def press_while_it_asks(admin: Visitor) -> None:
    """Press the button that bans once more: it asks for four seconds; a busy machine is late."""
    button = admin.page.get_by_role("button", name=re.compile("^Ban .*guest$"))

    def pressed() -> bool:
        admin.page.keyboard.press("Enter")
        return bool(admin.page.evaluate("window.sure"))

    button.focus()
    admin.until(pressed, "a press while it asks")


def test_an_administrator_mutes_freezes_and_bans_and_the_guest_is_told_and_refused(
    visitors: Open, serve: Serve, tmp_path: Path
) -> None:
    key, clock = new_key(), SystemClock()
    save_keys(tmp_path / "keys", KeyRing((key,)), replace=False)
    room = serve("--keys", str(tmp_path / "keys"))

    def link(name: str, **grants: bool) -> str:
        now = clock.now() + clock.to_wall()
        allowed = Grants(room="main", room_join=True, can_view=True, can_touch=True, **grants)
        claims = Claims(sub=name, jti=name, iat=now, exp=now + 600.0, haptic=allowed)
        return f"{room.address}#token={sign(claims, key)}"

    admin = visitors(DESKTOP)
    admin.visit(link("admin", room_admin=True))
    guest = visitors()
    guest.visit(link("guest"))
    guest.take_part("guest")
    guest.press(right=0.3)
    admin.until(lambda: given(admin) > 0.5, "the guest to press")
    assert not guest.page.get_by_role("button", name="Freeze the object").count()

    def order(name: str) -> None:
        admin.until(lambda: admin.page.get_by_role("button", name=name).count() == 1, name)
        admin.page.get_by_role("button", name=name).focus()
        admin.page.keyboard.press("Enter")

    order("Mute guest")
    guest.until(lambda: "You are muted" in guest.notice, "word of it")
    admin.until(lambda: admin.text(".card-law") == "muted", "the card to say so")
    # The hand still feels the object, which feels nothing of the hand.
    admin.until(lambda: given(admin) == 0.0, "the force to fade")
    assert guest.known_force() > 0.5
    order("Unmute guest")
    guest.until(lambda: guest.notice == "", "the word to go")
    admin.until(lambda: given(admin) > 0.5, "the force to come back")
    order("Freeze the object")
    guest.until(lambda: "The object is frozen" in guest.notice, "word of it")
    admin.until(lambda: given(admin) == 0.0, "the force to fade")
    order("Unfreeze the object")
    admin.until(lambda: given(admin) > 0.5, "the object to answer again")

    admin.page.evaluate(_NOTES_SURE)
    order("Ban guest")  # asks first, and forgets that where nobody goes on
    admin.page.get_by_role("button", name="Freeze the object").focus()
    assert admin.page.get_by_role("button", name="Ban guest").count() == 1
    order("Ban guest")
    press_while_it_asks(admin)
    guest.until(lambda: "You are out of this room" in guest.notice, "word of it")
    assert "banned from this room" in guest.notice
    admin.until(lambda: not admin.page.locator(".card[data-user]").count(), "the guest to go")
    guest.page.reload()
    guest.until(lambda: "You are out of this room" in guest.notice, "a refusal")
    again = visitors()
    again.page.goto(link("guest"))
    again.until(lambda: "banned" in again.notice, "a refusal of the invitation")
    for visitor in (admin, guest, again):
        visitor.away = True  # the server may end before the pages
