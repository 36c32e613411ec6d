"""How far off a person is: the network's figure, and what the page itself takes, are two things."""

from __future__ import annotations

import re

import pytest

from tests.browser.conftest import Open
from tests.browser.room import Room
from tests.browser.visitor import Visitor

pytestmark = pytest.mark.live

# In a browser that brings a Worker its messages through the page, they wait while that draws: here
# for 160 of each 260 ms.
_HELD = """() => {
  const plain = Object.getOwnPropertyDescriptor(WebSocket.prototype, "onmessage");
  Object.defineProperty(WebSocket.prototype, "onmessage", {
    set(hear) {
      const waiting = [];
      plain.set.call(this, (event) => {
        const left = 160 - (performance.now() % 260);
        if (waiting.length === 0 && left <= 0) return hear(event);
        waiting.push(event);
        if (waiting.length > 1) return;
        setTimeout(() => { for (const held of waiting.splice(0)) hear(held); }, Math.max(0, left));
      });
    },
  });
}"""
# The page's share of that.
_BUSY = """() => {
  const draw = () => {
    const begun = performance.now();
    while (performance.now() - begun < 120) continue;
    setTimeout(draw, 200);
  };
  draw();
}"""
_LOOP = re.compile(r"loop\s+(\d+)\sms")


def test_a_page_that_draws_slowly_is_not_taken_for_a_network_that_is_far(
    visitors: Open, room: Room
) -> None:
    ann, ben = visitors(), visitors()
    ann.visit(room.address)
    ann.until(lambda: len(ann.page.workers) == 1, "the Worker that waits for the hand")
    ann.page.workers[0].evaluate(_HELD)
    ann.take_part("ann")
    ben.visit(room.address)

    def words(visitor: Visitor) -> str:
        # In the page's text, though an engineer sees the numbers in their place.
        return visitor.page.locator(".card-people").text_content() or ""

    def slow() -> bool:
        found = _LOOP.search(ann.text(".card .facts"))
        return found is not None and int(found[1]) >= 150

    ann.until(slow, "a loop of 150 ms")
    ann.until(lambda: words(ann).startswith("Close by"), "a network that is near")
    ann.page.evaluate(_BUSY)
    ann.until(lambda: "this page is up to" in words(ann), "the page's own figure")
    assert words(ann).startswith("Close by")
    ben.until(lambda: "its machine included" in words(ben), "what others can know")
