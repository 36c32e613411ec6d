"""Rubbish in the address: the page opens, is one of ours, and runs nothing that came with it."""

from __future__ import annotations

import pytest
from playwright.sync_api import Dialog

from tests.browser.conftest import Open
from tests.browser.room import Room
from tests.browser.visitor import Look

pytestmark = pytest.mark.live

PEOPLE = Look(640, 480, engineer=False)
SCRIPT = "%3Cscript%3Ealert(1)%3C/script%3E%3Cimg%20src=x%20onerror=alert(1)%3E"
LONG = "A" * 7000  # a server takes 8 kB of an address
RUBBISH = [
    "?view=NaN", "?view=", f"?view={SCRIPT}", f"?view={LONG}", "?view=__proto__",
    "?follow=NaN", "?follow=-1", f"?follow={SCRIPT}", f"?follow={LONG}", "?follow=&follow=ann",
    "?name=", f"?name={SCRIPT}", f"?name={LONG}", "?name=%00%0a%E2%80%AE", "?name=%FF%FE",
    "?name=%", "?name=a&name=b&name=", "?room=../../etc/passwd", "?&&&===;;;", "?%00=%00",
    f"#token={SCRIPT}", f"#token={LONG}", "#token=", "#token=a&token=b", f"#{LONG}",
]  # fmt: skip


def test_rubbish_in_the_address_is_no_trouble(visitors: Open, room: Room) -> None:
    ann = visitors(PEOPLE)
    asked: list[str] = []

    def ask(dialog: Dialog) -> None:
        asked.append(dialog.message)
        dialog.dismiss()

    ann.page.on("dialog", ask)
    for rubbish in RUBBISH:
        ann.page.goto("about:blank")  # else a fragment alone would load nothing
        ann.visit(room.address + rubbish)
        name = ann.page.input_value(".name")
        assert 1 <= len(name) <= 32, rubbish
        assert name.isprintable(), rubbish
        assert "token" not in ann.page.url, rubbish
        # But for a word of a busy server's silence, which goes by itself.
        notice = ann.notice
        assert notice == "" or "No word from the server" in notice, rubbish
        ann.until(lambda: ann.notice == "", rubbish)
        assert ann.page.locator("img, .stage script").count() == 0, rubbish
        assert ann.page.evaluate("document.documentElement.scrollWidth") <= PEOPLE.width, rubbish
    assert asked == []
    # The last of them touches as anybody does.
    ann.press(right=0.1)
    ann.until(lambda: ann.force > 0.3, "a force")
    ann.release()
