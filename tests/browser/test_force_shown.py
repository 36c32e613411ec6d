"""A force is as large in one place as in another: arrow, ring and bars."""

from __future__ import annotations

import numpy as np
import pytest

from tests.browser.conftest import Open, Serve
from tests.browser.test_watch import picture
from tests.browser.visitor import Look, Visitor

pytestmark = pytest.mark.live

NEW = Look(1024, 720, engineer=False)
TIP, FULL, LONGEST = 0.045, 10.0, 1.2  # radii, N, radii (web/src/view/hands.ts)
# Still to be read, but not in the picture.
_BARE = """() => { for (const part of document.querySelectorAll(".stage > :not(.stage-host)"))
  part.style.opacity = "0";
for (const part of document.querySelectorAll(".label")) part.style.display = "none"; }"""


def ring(visitor: Visitor, x: float, y: float) -> float:
    """How far from a point of the window the green of the first hand is seen [px]."""
    visitor.page.evaluate(_BARE)
    visitor.catch_up()
    image = picture(visitor)
    box = visitor.page.locator(".stage-canvas").bounding_box()
    assert box is not None
    ys, xs = np.nonzero(image[:, :, 1] - image[:, :, [0, 2]].max(axis=2) > 0.1)
    return float(np.hypot(xs - (x - box["x"]), ys - (y - box["y"])).max(initial=0.0))


def test_a_force_that_points_at_the_eye_is_read_by_its_ring(visitors: Open, serve: Serve) -> None:
    """Where the ghost says to press, and where the camera does not lean."""
    ann = visitors(NEW)
    ann.page.emulate_media(reduced_motion="reduce")
    ann.visit(serve().address)  # a room of its own, since only the first hand is green
    ann.take_part("ann")
    ann.catch_up()
    x, y = ann.press()
    forces: list[float] = []
    radii: list[float] = []
    for _ in range(2):
        forces.append(ann.steady_force())
        ann.until(lambda: ring(ann, x, y) > 0.0, "a ring")
        radii.append(ring(ann, x, y))
        ann.page.mouse.wheel(0, -300)
        ann.page.mouse.wheel(0, -300)
        ann.until(lambda: ann.force > 1.2 * forces[-1], "more force")
    first, second = (TIP + LONGEST * force / FULL for force in forces)
    assert second > 1.1 * first
    assert radii[1] / radii[0] == pytest.approx(second / first, rel=0.1)
