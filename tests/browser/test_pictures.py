"""The page in pictures, for people to look at: `out/browser`. What can be checked of them is."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.browser.conftest import Open
from tests.browser.room import Room
from tests.browser.visitor import DESKTOP, PHONE, Look

pytestmark = pytest.mark.patient

OUT = Path(__file__).parents[2] / "out" / "browser"


@pytest.mark.parametrize("look", [DESKTOP, PHONE], ids=["desktop", "phone"])
def test_the_page_fits_its_window(visitors: Open, room: Room, look: Look) -> None:
    with room.hand("left", "--angle", "180"), room.hand("right", "--angle", "0"):
        ann = visitors(look)
        ann.visit(room.address)
        ann.take_part("ann")
        ann.press(right=0.1, up=0.1)
        ann.until(
            lambda: min(ann.force_of("left"), ann.force_of("right")) > 1.0,
            "left and right to press",
        )
        ann.steady_force()
        OUT.mkdir(parents=True, exist_ok=True)
        for scheme in ("light", "dark"):
            ann.prefer(scheme)
            name = f"{'phone' if look.phone else 'desktop'}-{scheme}.png"
            ann.page.screenshot(path=OUT / name, caret="initial")
        assert ann.page.evaluate("document.documentElement.scrollWidth") <= look.width
        for part in (".bar", ".dock", ".stage-canvas"):
            box = ann.page.locator(part).bounding_box()
            assert box is not None, part
            assert box["x"] >= 0.0, part
            assert box["x"] + box["width"] <= look.width, part
            assert box["y"] + box["height"] <= look.height, part
