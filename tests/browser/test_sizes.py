"""The page in windows of many sizes, in both themes and levels; pictures of it in `out/browser`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from tests.browser.conftest import Open
from tests.browser.room import Room
from tests.browser.visitor import Look, Visitor, at_night

pytestmark = pytest.mark.live

OUT = Path(__file__).parents[2] / "out" / "browser"
LONG = "W" * 32  # the widest letter, as often as a name may have it
# The extremes in every run of all tests, those between at night.
SIZES = [
    *(Look(390, 844, phone=True), Look(844, 390, phone=True), Look(1440, 900)),
    *(at_night(look) for look in (Look(720, 450), Look(820, 1180), Look(1024, 700))),
]
# What is cut off at the right, or lies under another thing it should lie beside.
_OUTSIDE = """() => [...document.querySelectorAll(
  ".panel, .panel .card-force, .panel .card-name, .panel .level, .panel .facts dd, .panel .plot,"
  + ".bar button, .dock-main, .dock-main *, .legend")]
  .filter((part) => part.checkVisibility({ visibilityProperty: true }))
  .filter((part) => {
    const { left, right } = part.getBoundingClientRect();
    const panel = part.closest(".panel");
    const edge = part.closest(".stage")?.getBoundingClientRect().right ?? innerWidth;
    return left < -0.5 || right > (panel === null ? edge : innerWidth) + 0.5;
  })
  .map((part) => part.className.toString() || part.outerHTML)"""


def share_of_dock(visitor: Visitor) -> float:
    """Of the stage's height."""
    return visitor.height(".dock") / visitor.height(".stage")


@pytest.mark.parametrize("look", SIZES, ids=str)
@pytest.mark.parametrize("engineer", [False, True], ids=["people", "engineer"])
def test_nothing_is_cut_off_whoever_is_here(
    visitors: Open, room: Room, look: Look, *, engineer: bool
) -> None:
    with room.hand("left", "--angle", "180"), room.hand(LONG, "--angle", "0"):
        ann = visitors(replace(look, engineer=engineer))
        ann.visit(room.address)
        ann.take_part("ann")
        ann.press(right=0.1, up=0.1)
        ann.until(lambda: all(ann.force_of(name) > 1.0 for name in ("left", LONG)), "both to press")
        ann.steady_force()
        OUT.mkdir(parents=True, exist_ok=True)
        level = "engineer" if engineer else "people"
        for scheme in ("light", "dark"):
            ann.prefer(scheme)
            name = f"size-{look.width}x{look.height}-{level}-{scheme}.png"
            ann.page.screenshot(path=OUT / name, caret="initial")
        assert ann.page.evaluate(_OUTSIDE) == []
        if not engineer:
            assert share_of_dock(ann) < 0.34
            assert not ann.page.locator(".dock-law").is_visible()
        handle = ann.page.locator(".sheet-handle")
        if handle.is_visible():
            ann.release()
            box = handle.bounding_box()
            assert box is not None
            assert box["y"] > 0.9 * look.height
            handle.click()
            ann.until(lambda: (handle.bounding_box() or {"y": 1e9})["y"] < 0.4 * look.height, "it")
            ann.page.screenshot(path=OUT / f"sheet-{look.width}-{level}.png", caret="initial")
            assert ann.page.evaluate(_OUTSIDE) == []
