"""What a visitor's system asks for: more contrast, less motion; and a page at 200 %."""

from __future__ import annotations

import re
from typing import Literal

import pytest

from tests.browser.conftest import Open
from tests.browser.room import Room
from tests.browser.test_sizes import OUT
from tests.browser.visitor import Look, Visitor

pytestmark = pytest.mark.live

WINDOW = Look(1280, 800)
HALF = Look(640, 400)  # what is left of 1280 x 800 at 200 %
ENOUGH = 7.0  # contrast of text to what is behind it that WCAG's AAA asks for
_COLOURS = """(part) => [getComputedStyle(document.querySelector(part)).color,
  getComputedStyle(document.querySelector(".panel")).backgroundColor]"""


def luminance(colour: str) -> float:
    shares = [int(x) / 255.0 for x in re.findall(r"\d+", colour)[:3]]
    r, g, b = (c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in shares)
    return 0.2126 * r + 0.7152 * g + 0.0722 * b


def contrast(visitor: Visitor, part: str) -> float:
    """Of a text of the panel."""
    dark, light = sorted(luminance(colour) for colour in visitor.page.evaluate(_COLOURS, part))
    return (light + 0.05) / (dark + 0.05)


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_more_contrast_is_more_by_day_and_by_night(
    visitors: Open, room: Room, scheme: Literal["light", "dark"]
) -> None:
    ann = visitors(WINDOW)
    ann.visit(room.address)
    ann.prefer(scheme)
    ann.page.click(".touch-button")
    ann.until(lambda: ann.text(".facts dt") != "", "the own card")
    before = contrast(ann, ".facts dt")
    ann.page.emulate_media(contrast="more")
    assert contrast(ann, ".facts dt") > max(ENOUGH, 1.2 * before)
    line = "getComputedStyle(document.querySelector('.panel')).borderLeftColor"
    dark, light = sorted(
        luminance(ann.page.evaluate(words))
        for words in (line, line.replace("borderLeftColor", "backgroundColor"))
    )
    assert (light + 0.05) / (dark + 0.05) > 3.0, "a line that cannot be seen"


@pytest.mark.parametrize("engineer", [False, True], ids=["people", "engineer"])
def test_at_200_percent_the_object_can_be_seen_and_pressed(
    visitors: Open, room: Room, *, engineer: bool
) -> None:
    ann = visitors(Look(HALF.width, HALF.height, engineer=engineer))
    ann.visit(room.address)
    ann.take_part("ann")
    ann.press(right=0.1)
    ann.until(lambda: ann.force > 0.5, "a force")
    OUT.mkdir(parents=True, exist_ok=True)
    level = "engineer" if engineer else "people"
    ann.page.screenshot(path=OUT / f"zoom-200-{level}.png", caret="initial")
    free = ann.height(".stage") - ann.height(".bar") - ann.height(".dock")
    assert free > 0.45 * ann.height(".stage")
    # All that there is can be reached: nothing is past the window, and the panel scrolls.
    assert ann.page.evaluate("document.documentElement.scrollWidth") <= HALF.width
    scrolls = """() => {
      const panel = document.querySelector(".panel");
      return panel.scrollHeight <= panel.clientHeight + 1
        || ["auto", "scroll"].includes(getComputedStyle(panel).overflowY);
    }"""
    assert ann.page.evaluate(scrolls)
    ann.release()
