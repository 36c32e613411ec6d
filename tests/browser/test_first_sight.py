"""What a first visitor sees: words before the picture, people apart, colours that mean it."""

from __future__ import annotations

from typing import Any

import pytest

from tests.browser.conftest import Open
from tests.browser.room import Room
from tests.browser.visitor import Look

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
