"""The guided tour, from its first step to its last, beside a hand that presses in a rhythm."""

from __future__ import annotations

import math
import re
from functools import partial

import pytest

from tests.browser.conftest import Open
from tests.browser.room import Room
from tests.browser.visitor import Visitor

pytestmark = pytest.mark.live

STEPS = [
    "welcome", "press", "feel", "sheet", "ocean", "paper", "coupled", "soft", "ours", "yours",
]  # fmt: skip
WAITING = ".tour-word + .tour-word"  # the first is on what was left out
# s; of the room: with a hand of the rule for one, and with hands whose object is quick.
LAG = {"paper": (0.07, 1.0), "ours": (0.0, 0.07)}
OCEAN = 240.0  # ms there and back, web/src/tour/steps.ts


def now(visitor: Visitor) -> float:
    """The own force as the trace says it [N]; nan before it does."""
    said = re.search(r"now: ([\d.]+) N", visitor.text(".trace-mine"))
    return math.nan if said is None else float(said[1])


def test_the_guided_tour_shows_what_it_tells_of(visitors: Open, room: Room) -> None:
    ann = visitors()
    ann.visit(room.address)
    with room.hand("native", "--angle", "0", "--rhythm-s", "3"):
        ann.until(lambda: ann.force_of("native") > 0.5, "the native hand to press")
        ann.page.click(".tour-button")
        # It goes on by itself once a step is read and shown, also while this looks at it.
        ann.page.locator(".tour-foot button", has_text="Pause").click()
        card = ann.page.locator(".tour")

        def at(step: str) -> bool:
            return card.get_attribute("data-step") == step

        def within(low: float, high: float) -> bool:
            return low <= ann.lag <= high

        for step in STEPS:
            ann.until(partial(at, step), step)
            ann.until(lambda: ann.text(WAITING) == "", f"what {step} is to show")
            assert at(step), "it gave up waiting"
            if step == "feel":
                ann.until(lambda: now(ann) > 0.3, "the trace to say what is felt")
            if step in LAG:
                ann.until(partial(within, *LAG[step]), f"the lag of {step}")
            if step == "ocean":
                loop = re.search(r"loop\s+(\d+)\s*ms", ann.text(".card.own").lower())
                assert loop is not None
                assert float(loop[1]) > 0.9 * OCEAN
            if step == "coupled":
                words = "kept from swinging"
                ann.until(lambda: words in ann.text(".area-card"), words)  # noqa: B023
            ann.page.click(".tour-foot .primary")
        assert not ann.page.locator(".tour").is_visible()
    # All is as it was before: no hand in the room, no delay.
    ann.until(lambda: ann.text(".touch-words") == "Touch it", "the hand to have left")
    ann.until(lambda: "Nobody is here yet" in ann.words(), "everybody to have left")
