"""A window that is dragged to a display with finer pixels, or zoomed: nobody tells the page."""

from __future__ import annotations

from typing import Any

import pytest

from tests.browser.conftest import Open
from tests.browser.room import Room
from tests.browser.test_software_graphics import BY_ANOTHER_NAME
from tests.browser.visitor import SMALL

pytestmark = pytest.mark.live

_PIXELS = "(canvas) => canvas.width / canvas.clientWidth"


def test_the_object_is_drawn_with_the_pixels_of_the_display_that_the_window_is_on(
    visitors: Open, room: Room
) -> None:
    ann = visitors()
    # As on graphics that keep up; in software no display is worth all of its pixels.
    ann.page.add_init_script(BY_ANOTHER_NAME)
    ann.visit(room.address)
    display: Any = ann.page.context.new_cdp_session(ann.page)

    def drawn() -> float:
        """Pixels for one of the window."""
        return float(ann.page.locator(".stage-canvas").evaluate(_PIXELS))

    assert drawn() <= 1.0
    window = {"width": SMALL.width, "height": SMALL.height, "mobile": False}
    display.send("Emulation.setDeviceMetricsOverride", {**window, "deviceScaleFactor": 2})
    ann.until(lambda: drawn() > 1.0, "more pixels")
    display.send("Emulation.setDeviceMetricsOverride", {**window, "deviceScaleFactor": 0.5})
    ann.until(lambda: drawn() == 0.5, "no more than there are")
