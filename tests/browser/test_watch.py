"""What a page shows of the room to one who only watches."""

from __future__ import annotations

import io
from typing import Any

import matplotlib.image
import numpy as np
import pytest

from cohaptic_server.numeric import Floats
from tests.browser.conftest import Open
from tests.browser.room import Room
from tests.browser.visitor import Visitor

pytestmark = pytest.mark.live

SAME = 0.01  # share of a picture
DENT = ("--angle", "-80", "--depth-mm", "40")  # degrees; in sight of the first view


def picture(visitor: Visitor) -> Floats:
    """The stage as it is seen, shape (h, w, 3), 0 to 1."""
    # Hiding the caret would be a style that the page's policy forbids.
    png = visitor.page.locator(".stage-canvas").screenshot(caret="initial")
    image: Any = matplotlib.image.imread(io.BytesIO(png))
    return np.asarray(image[:, :, :3], float)


def difference(a: Floats, b: Floats) -> float:
    """Share of the picture that differs by more than shades, in tiles of 8 by 8 pixels.

    A slow page draws fewer pixels, which moves every edge by a part of one.
    """
    return float((np.abs(_tiles(a) - _tiles(b)).max(axis=2) > 0.1).mean())


def _tiles(image: Floats) -> Floats:
    """Means over tiles of 8 by 8 pixels, shape (h / 8, w / 8, 3)."""
    h, w = (k // 8 * 8 for k in image.shape[:2])
    return np.asarray(image[:h, :w].reshape(h // 8, 8, w // 8, 8, 3).mean(axis=(1, 3)))


def test_a_late_comer_sees_the_dent_at_once_and_in_both_encodings(
    visitors: Open, room: Room
) -> None:
    early = visitors()
    early.visit(room.address)
    early.page.locator(".stream .choice-option", has_text="frames").click()
    early.until(lambda: difference(picture(early), picture(early)) == 0.0, "the view to settle")
    resting = picture(early)
    with room.hand("native", *DENT) as native:
        early.until(lambda: native.status.force > 1.0, "the native hand to press")
        early.until(lambda: early.force_of("native") > 1.0, "the early page to show it")
        late = visitors()
        # Whoever comes late is told of the scene once: nothing of it may be the surface at rest.
        late.visit(room.address)
        late.until(lambda: late.force_of("native") > 1.0, "the late page to show it")

        def apart() -> float:
            # A slow page draws fewer pixels, and taking pictures makes it slow: let it rest.
            late.page.wait_for_timeout(1500)
            return difference(picture(late), picture(early))

        late.until(lambda: apart() < SAME, "the same dent")
        assert difference(picture(late), resting) > 5.0 * SAME
