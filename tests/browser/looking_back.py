"""A page that looks back at the last minute."""

from __future__ import annotations

import math
import re

from cohaptic_server.numeric import Floats
from tests.browser.room import Room
from tests.browser.test_watch import difference, picture
from tests.browser.visitor import Visitor


def ago(visitor: Visitor) -> float:
    """How long before now the shown time is [s]; nan for live."""
    found = re.search(r"([\d.]+)\ss ago", visitor.text(".replay-when"))
    return math.nan if found is None else float(found[1])


def replays(visitor: Visitor) -> bool:
    return visitor.text(".replay-tag") == "Replay"


def share(visitor: Visitor) -> float:
    """Where the line is, of the recording."""
    return float(visitor.page.locator(".replay-line").input_value())


def scrub(visitor: Visitor, to: float) -> None:
    visitor.page.locator(".replay-line").evaluate(
        "(line, to) => { line.value = to; line.dispatchEvent(new Event('input')); }", to
    )


def heard_at(visitor: Visitor, name: str) -> float:
    """A share of the recording at which somebody was heard of: a busy machine has silences."""
    shares = iter(range(95, 0, -5))

    def heard() -> bool:
        scrub(visitor, next(shares, 50) / 100.0)
        visitor.page.wait_for_timeout(450)
        visitor.catch_up()
        return not math.isnan(visitor.force_of(name))

    visitor.until(heard, f"a moment in which {name} was heard")
    return share(visitor)


def whole_picture(visitor: Visitor) -> Floats:
    """The picture of a moment that stands, once it is all there.

    Its surface may be on its way, and a page that is slow shows the picture before for long.
    """
    seen = [picture(visitor)]

    def stays() -> bool:
        visitor.page.wait_for_timeout(600)
        visitor.catch_up()
        seen.append(picture(visitor))
        whole = visitor.text(".replay-trouble") == ""
        # But for the words that say how long ago it was.
        return whole and len(seen) > 2 and difference(seen[-2], seen[-1]) < 0.002

    visitor.until(stays, "a picture that stands")
    return seen[-1]


def look_back(visitor: Visitor, room: Room, seconds: float) -> None:
    """Open the page of a room in which a hand moves, watch for some time, and look back."""
    visitor.visit(room.address)
    visitor.until(lambda: visitor.force_of("native") > 0.5, "the native hand to press")
    visitor.page.wait_for_timeout(1000.0 * seconds)
    visitor.page.locator(".stage-host").focus()
    visitor.page.keyboard.press("b")
    visitor.until(lambda: replays(visitor), "the replay")


def looks_of_before(visitor: Visitor) -> None:
    """Frame, colour, lamp, words: nothing that could be taken for now."""
    assert replays(visitor)
    assert visitor.page.locator(".lamp").get_attribute("data-phase") == "replay"
    frame = "getComputedStyle(document.querySelector('.stage'), '::after').borderTopStyle"
    assert visitor.page.evaluate(frame) == "dashed"
    style = visitor.page.locator(".stage-canvas").evaluate("node => getComputedStyle(node).filter")
    assert "sepia" in style or "grayscale" in style
    assert ago(visitor) >= 0.0
