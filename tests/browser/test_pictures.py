"""The page in pictures, for people to look at: `out/browser`. What can be checked of them is."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.browser.conftest import Open
from tests.browser.room import Room
from tests.browser.visitor import DESKTOP, PHONE, Look

pytestmark = pytest.mark.live

OUT = Path(__file__).parents[2] / "out" / "browser"
TABLET = Look(820, 1180)
SMALLEST = Look(360, 740, phone=True)


# Parts of the panel that run past it when all numbers of the cards are as long as they come.
_PAST_THE_PANEL = """() => {
  const panel = document.querySelector(".panel");
  const { right } = panel.getBoundingClientRect();
  for (const number of panel.querySelectorAll(".facts dd")) number.textContent = "9999\u202fN/m";
  const parts = [...panel.querySelectorAll(".cards *")];
  return parts.filter((part) => part.getBoundingClientRect().right > right - 10)
    .map((part) => part.outerHTML);
}"""


@pytest.mark.parametrize(
    "look", [DESKTOP, TABLET, PHONE, SMALLEST], ids=["desktop", "tablet", "phone", "smallest"]
)
def test_the_page_fits_its_window(visitors: Open, room: Room, look: Look) -> None:
    with room.hand("left", "--angle", "180"), room.hand("right", "--angle", "0"):
        ann = visitors(look)
        ann.visit(room.address)
        ann.take_part("ann")
        ann.press(right=0.1, up=0.1)
        ann.until(
            lambda: all(ann.force_of(name) > 1.0 for name in ("left", "right")),
            "left and right to press",
        )
        ann.steady_force()
        OUT.mkdir(parents=True, exist_ok=True)
        for scheme in ("light", "dark"):
            ann.prefer(scheme)
            ann.page.screenshot(path=OUT / f"page-{look.width}-{scheme}.png", caret="initial")
        assert ann.page.evaluate("document.documentElement.scrollWidth") <= look.width
        for part in (".bar", ".dock", ".stage-canvas"):
            box = ann.page.locator(part).bounding_box()
            assert box is not None, part
            assert box["x"] >= 0.0, part
            assert box["x"] + box["width"] <= look.width, part
            assert box["y"] + box["height"] <= look.height, part
        legend = ann.page.locator(".legend").bounding_box()
        dock = ann.page.locator(".dock-main").bounding_box()
        assert legend is not None
        assert dock is not None
        beside = dock["x"] >= legend["x"] + legend["width"]
        assert beside or dock["y"] >= legend["y"] + legend["height"]
        assert ann.page.evaluate(_PAST_THE_PANEL) == []
