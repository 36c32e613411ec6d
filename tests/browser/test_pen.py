"""A pen: its pressure is the depth, its tip the press, and its barrel button turns the view."""

from __future__ import annotations

from typing import Any

import pytest

from tests.browser.conftest import Open
from tests.browser.room import Room
from tests.browser.test_let_go import WIDE, is_off
from tests.browser.visitor import Visitor

pytestmark = pytest.mark.live

TIP, BARREL = 1, 2  # of the buttons, as bits


class Pen:
    """A pen over the middle of the stage, by the browser's own protocol."""

    def __init__(self, visitor: Visitor) -> None:
        self._cdp: Any = visitor.page.context.new_cdp_session(visitor.page)
        box = visitor.page.locator(".stage-canvas").bounding_box()
        assert box is not None
        self.x = box["x"] + 0.5 * box["width"]
        self.y = box["y"] + 0.5 * (box["height"] - visitor.height(".dock"))

    def say(self, kind: str, button: str, buttons: int, force: float, right: float = 0.0) -> None:
        """One event; `force` is 0 to 1."""
        self._cdp.send(
            "Input.dispatchMouseEvent",
            {
                "type": kind, "x": self.x + right, "y": self.y, "button": button,
                "buttons": buttons, "force": force, "pointerType": "pen", "clickCount": 1,
            },
        )  # fmt: skip


def held(visitors: Open, room: Room) -> tuple[Visitor, Pen]:
    """A page on which a pen presses lightly."""
    ann = visitors(WIDE)
    ann.visit(room.address)
    ann.take_part("ann")
    pen = Pen(ann)
    pen.say("mouseMoved", "none", 0, 0.0)
    pen.say("mousePressed", "left", TIP, 0.2)
    ann.until(lambda: ann.force > 0.3, "a force")
    return ann, pen


def test_harder_is_deeper_and_lifted_is_off(visitors: Open, room: Room) -> None:
    ann, pen = held(visitors, room)
    light = ann.steady_force()
    pen.say("mouseMoved", "left", TIP, 0.7)
    ann.until(lambda: ann.force > 1.5 * light, "more of it")
    pen.say("mouseMoved", "left", TIP, 0.2)
    ann.until(lambda: abs(ann.force - light) < 0.1 * light, "as much as before")
    pen.say("mouseReleased", "left", 0, 0.0)
    is_off(room)
    ann.until(lambda: ann.force == 0.0, "the page to show it")
    # It hovers, and what hovers feels nothing.
    pen.say("mouseMoved", "none", 0, 0.0, 8.0)
    ann.page.wait_for_timeout(500)
    assert ann.known_force() == 0.0


@pytest.mark.parametrize("end", ["pointercancel", "lostpointercapture"])
def test_a_pen_out_of_reach_lets_go(visitors: Open, room: Room, end: str) -> None:
    ann, _ = held(visitors, room)
    ann.page.evaluate(
        """(end) => {
          const host = document.querySelector(".stage-host");
          for (let id = 1; id < 40; id++) {
            host.dispatchEvent(new PointerEvent(end, { pointerId: id, pointerType: "pen" }));
          }
        }""",
        end,
    )
    is_off(room)
