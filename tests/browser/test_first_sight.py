"""What a first visitor sees: words before the picture, people apart, colours that mean it."""

from __future__ import annotations

import math
import re
from typing import Any

import pytest

from tests.browser.conftest import Open
from tests.browser.room import Room
from tests.browser.visitor import Look, Visitor

pytestmark = pytest.mark.live

WINDOW = Look(1024, 720)
# What there is in the moment that the words are there, as the page itself notes it: a look from
# outside may come when the graphics are there as well.
_FIRST = """
new MutationObserver((_, observer) => {
  if (document.querySelector(".touch-button") === null) return;
  observer.disconnect();
  const host = document.querySelector(".stage-host");
  window.atFirst = [
    document.querySelector(".tour-button").ariaLabel, host.ariaBusy,
    document.querySelectorAll(".stage-canvas").length, getComputedStyle(host, "::before").content,
  ];
}).observe(document, { childList: true, subtree: true });
"""
_PLAIN = "node => getComputedStyle(node).backgroundColor"


def rgb(visitor: Visitor, selector: str) -> list[tuple[int, ...]]:
    colours: list[str] = visitor.page.locator(selector).evaluate_all(f"all => all.map({_PLAIN})")
    return [tuple(int(x) for x in re.findall(r"\d+", colour)[:3]) for colour in colours]


def test_whoever_comes_and_goes_no_two_have_one_colour_nor_that_of_the_field(
    visitors: Open, room: Room
) -> None:
    ann = visitors(Look(1024, 720, engineer=False))
    ann.visit(room.address)
    swatches: list[tuple[int, ...]] = []
    with room.hand("stays", "--angle", "180"):
        ann.until(lambda: not math.isnan(ann.force_of("stays")), "the one who stays")
        # Numbers go on rising: the ninth and more once had the colours of the first.
        for turn in range(8):
            with room.hand(f"comes {turn}", "--angle", "0"):
                ann.until(lambda: not math.isnan(ann.force_of(f"comes {turn}")), "another")  # noqa: B023
                ann.until(lambda: len(set(rgb(ann, ".card .swatch"))) >= 2, "two colours")
                swatches = rgb(ann, ".card .swatch")
                assert len(set(swatches)) == len(swatches)
        strip: list[int] = ann.page.locator(".legend-strip").evaluate("""(node) =>
          [...node.getContext("2d").getImageData(0, 0, node.width, 1).data]""")
    for end in (strip[:3], strip[-4:-1]):
        for swatch in swatches:
            assert math.dist(end, swatch) > 60.0, "a person has a colour of the field"


def test_words_and_buttons_are_there_before_the_graphics_on_a_slow_line(
    visitors: Open, room: Room
) -> None:
    ann = visitors(WINDOW)
    network: Any = ann.page.context.new_cdp_session(ann.page)
    network.send("Network.enable")
    slow = {"offline": False, "latency": 150, "downloadThroughput": 2e5, "uploadThroughput": 2e5}
    network.send("Network.emulateNetworkConditions", slow)
    ann.page.add_init_script(_FIRST)
    ann.page.goto(room.address, wait_until="commit")
    ann.page.wait_for_selector(".touch-button")
    words, busy, canvases, outline = ann.page.evaluate("atFirst")
    assert words == "Guided tour"
    assert busy == "true"
    assert canvases == 0, "the words waited for the graphics"
    assert outline != "none", "an empty stage"
    ann.until(ann.watches, "the picture")
    assert not ann.outlined
