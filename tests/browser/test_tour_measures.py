"""What the tour claims, by the numbers that it measures itself, with the partner that it brings."""

from __future__ import annotations

import math
import re
from functools import partial

import pytest

from tests.browser.conftest import Open
from tests.browser.room import Room
from tests.browser.test_sizes import OUT
from tests.browser.visitor import PHONE, Look, Visitor

pytestmark = pytest.mark.live

SWINGS, RESTS = 0.5, 0.02  # N
WIDE = Look(1024, 720)
WAITING = ".tour-word + .tour-word"  # the first is on what was left out
STEPS = ["welcome", "press", "feel", "sheet", "ocean", "paper", "coupled", "soft", "ours", "yours"]


def measured(visitor: Visitor, name: str) -> float:
    """A number behind the large trace; nan before it is there."""
    said = visitor.page.locator(".trace").get_attribute(f"data-{name}")
    return float(said) if said else math.nan


@pytest.mark.parametrize("look", [WIDE, PHONE], ids=["window", "phone"])
def test_the_tour_brings_a_partner_and_measures_what_it_claims(
    visitors: Open, room: Room, look: Look
) -> None:
    ann = visitors(look)
    ann.visit(room.address)
    ann.page.click(".tour-button")
    # It would go on by itself, while this looks at it.
    ann.page.locator(".tour-foot button", has_text="Pause").click()
    card = ann.page.locator(".tour")

    def at(step: str) -> bool:
        return card.get_attribute("data-step") == step

    def claim(words: str) -> bool:
        return words in ann.text(".tour-claim")

    for step in STEPS:
        ann.until(partial(at, step), step)
        if step == "feel":
            # Nobody else was here: the partner is a hand in the room like any other.
            room.until(lambda users: len(users) == 2, "the partner")
            ann.until(lambda: ann.force_of("simulated partner") > 0.5, "the partner to press")
            ann.until(lambda: claim("come from others"), "the claim")
        if step == "ocean":
            ann.until(lambda: ann.text(WAITING) == "", "the longer loop to be measured")
        if step == "coupled":
            ann.until(lambda: measured(ann, "rehearsed") >= SWINGS, "the rule for one to swing")
            ann.until(lambda: claim("times a second"), "the claim")
            said = re.search(r"swing by ([\d.]+) N, ([\d.]+) times", ann.text(".tour-claim"))
            assert said is not None
            assert float(said[1]) == pytest.approx(measured(ann, "rehearsed"), abs=0.006)
            # A force that returns turned after T swings at 1 / (2 T), or at an odd multiple of it
            # if the two loops differ by a tick or two; two ticks make the fastest swing.
            assert 0.3 < float(said[2]) <= 30.0
            picture(ann, "coupled")
        if step == "ours":
            ann.until(lambda: measured(ann, "swing") <= RESTS, "the own force to rest")
            ann.until(lambda: claim("less than a finger feels"), "the claim")
            for part in (".trace", ".tour-claim"):
                # A word of a busy server's silence goes by itself.
                ann.until(partial(in_sight, ann, part), f"{part} to be in sight")
            picture(ann, "ours")
        ann.page.click(".tour-foot .primary")
    # With the tour goes who came with it.
    room.until(lambda users: users == {}, "everybody to have left")


def in_sight(visitor: Visitor, selector: str) -> bool:
    """Whether all of it is in the window, and nothing lies over its middle."""
    return bool(
        visitor.page.locator(selector).evaluate("""(node) => {
          const { left, right, top, bottom } = node.getBoundingClientRect();
          const inside = left >= 0 && right <= innerWidth && top >= 0 && bottom <= innerHeight;
          node.style.pointerEvents = "auto";
          const over = document.elementFromPoint((left + right) / 2, (top + bottom) / 2);
          return inside && node.contains(over);
        }""")
    )


def picture(visitor: Visitor, step: str) -> None:
    OUT.mkdir(parents=True, exist_ok=True)
    width = visitor.page.evaluate("innerWidth")
    visitor.page.screenshot(path=OUT / f"tour-{width}-{step}.png", caret="initial")
