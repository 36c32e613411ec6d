"""The page in pictures, for people to look at: `out/browser`. What can be checked of them is."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.browser.conftest import Open, Serve
from tests.browser.visitor import Look

OUT = Path(__file__).parents[2] / "out" / "browser"
DESKTOP, PHONE = (1440, 900), (390, 844)


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
@pytest.mark.parametrize("size", [DESKTOP, PHONE], ids=["desktop", "phone"])
def test_the_page_fits_its_window(
    visitors: Open, serve: Serve, size: tuple[int, int], dark: bool
) -> None:
    phone = size == PHONE
    room = serve("--allow-latency", "--allow-fixed-gains")
    with room.hand("left", "--angle", "180", "--rhythm-s", "3"), room.hand("right", "--angle", "0"):
        ann = visitors(Look(*size, dark=dark, phone=phone))
        ann.visit(room.address)
        ann.take_part("ann")
        ann.press(right=0.1, up=0.1)
        ann.steady_force()
        ann.until(lambda: ann.force_of("left") > 1.0, "left to press")
        OUT.mkdir(parents=True, exist_ok=True)
        name = f"{'phone' if phone else 'desktop'}-{'dark' if dark else 'light'}.png"
        ann.page.screenshot(path=OUT / name)
        assert ann.page.evaluate("document.documentElement.scrollWidth") <= size[0]
        for part in (".bar", ".dock", ".stage-canvas"):
            box = ann.page.locator(part).bounding_box()
            assert box is not None, part
            assert box["x"] >= 0.0, part
            assert box["x"] + box["width"] <= size[0], part
            assert box["y"] + box["height"] <= size[1], part
