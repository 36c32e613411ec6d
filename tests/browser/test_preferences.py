"""What a visitor's system asks for: more contrast, less motion; and a page at 200 %."""

from __future__ import annotations

import re
from typing import Literal

import pytest

from tests.browser.conftest import Open
from tests.browser.room import Room
from tests.browser.visitor import Look, Visitor

pytestmark = pytest.mark.live

WINDOW = Look(1280, 800)
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
