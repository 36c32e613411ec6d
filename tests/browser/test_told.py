"""What others do is seen on the page, and whom of them one feels."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.browser.conftest import Open
from tests.browser.room import Room
from tests.browser.visitor import Look

pytestmark = pytest.mark.live

OUT = Path(__file__).parents[2] / "out" / "browser"
NEW = Look(1024, 720, engineer=False)
LOOKS = [
    Look(390, 844, True, False),
    Look(820, 1180, engineer=False),
    Look(1440, 900, engineer=False),
]
OPPOSITE = ("--angle", "100", "--depth-mm", "20")  # degrees; of where one presses in the first view


def test_who_comes_presses_and_leaves_is_read_by_one_who_watches(
    visitors: Open, room: Room
) -> None:
    ann = visitors(NEW)
    ann.visit(room.address)
    assert ann.text(".told") == ""
    bob = visitors(NEW)
    bob.visit(room.address)
    bob.take_part("Bob")
    ann.until(lambda: ann.text(".told-news") == "Bob has come.", "who has come")
    bob.press()
    bob.until(lambda: bob.force > 0.5, "a force")
    ann.until(lambda: ann.text(".told-news") == "Bob presses.", "who presses")
    assert bob.text(".told") == "", "nobody is told of what he does himself"
    bob.release()
    ann.until(lambda: ann.text(".told") == "", "the press to end")
    bob.leave()
    ann.until(lambda: ann.text(".told-news") == "Bob has left.", "who has left")
    ann.until(lambda: ann.text(".told") == "", "the news to go")
    assert bob.text(".told") == ""


@pytest.mark.parametrize("look", LOOKS, ids=str)
def test_the_words_are_in_the_picture_and_take_no_press(
    visitors: Open, room: Room, look: Look
) -> None:
    ann = visitors(look)
    ann.visit(room.address)
    ann.press()
    ann.until(lambda: ann.force > 0.5, "a force")
    with room.hand("Bob with quite a long name", *OPPOSITE):
        ann.until(lambda: "pushes you" in ann.text(".told-push"), "who pushes")
        OUT.mkdir(parents=True, exist_ok=True)
        ann.page.screenshot(path=OUT / f"told-{look.width}-light.png", caret="initial")
        ann.prefer("dark")
        ann.catch_up()
        ann.page.screenshot(path=OUT / f"told-{look.width}-dark.png", caret="initial")
        box = ann.page.locator(".told-push").bounding_box()
        assert box is not None
        assert box["x"] >= 0.0
        assert box["x"] + box["width"] <= look.width
        there = f"{box['x'] + 0.5 * box['width']}, {box['y'] + 0.5 * box['height']}"
        under = ann.page.evaluate(f"document.elementFromPoint({there}).className")
        assert under == "stage-canvas"
