"""What axe-core finds on the page: nothing, in any window, theme and state; and lost graphics."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import pytest

from tests.browser.conftest import Open
from tests.browser.room import Room
from tests.browser.test_silence import COLOURED, colour
from tests.browser.test_sizes import OUT
from tests.browser.visitor import SMALL, Look, Visitor
from tests.give_up import give_up

pytestmark = pytest.mark.patient

AXE = Path(__file__).parents[2] / "web" / "node_modules" / "axe-core" / "axe.min.js"
SIZES = [Look(390, 844, phone=True), Look(820, 1180), Look(1024, 700), Look(1440, 900)]
_RUN = """async () => {
  const { passes, violations } = await axe.run(document);
  return [passes.length, violations.flatMap(({ id, nodes }) =>
    nodes.map((node) => `${id}: ${node.html} ${node.failureSummary}`))];
}"""

Theme = Literal["light", "dark", "forced"]


def violations(visitor: Visitor, theme: Theme) -> list[str]:
    """What axe-core finds now."""
    visitor.page.emulate_media(
        color_scheme="dark" if theme == "dark" else "light",
        forced_colors="active" if theme == "forced" else "none",
    )
    scheme = "dark" if theme == "dark" else "light"
    visitor.until(lambda: visitor.page.locator("html").get_attribute("data-theme") == scheme, theme)
    passed, found = visitor.page.evaluate(_RUN)
    assert passed > 10, "axe-core has looked at nothing"
    return list(found)


@pytest.mark.parametrize("look", SIZES, ids=[f"{look.width}" for look in SIZES])
def test_axe_finds_nothing(visitors: Open, room: Room, look: Look) -> None:
    if not AXE.is_file():
        give_up("axe-core is not here: npm ci in web/")
    ann = visitors(look)
    # The page's policy lets in no script of others; the test's own world is not asked.
    ann.page.add_init_script(path=AXE)
    ann.visit(room.address)
    OUT.mkdir(parents=True, exist_ok=True)
    found: dict[str, list[str]] = {}

    def look_at(state: str) -> None:
        themes: tuple[Theme, ...] = ("light", "dark", "forced")
        for theme in themes:
            found[f"{state}, {theme}"] = violations(ann, theme)
            name = f"access-{look.width}-{state}-{theme}.png"
            ann.page.screenshot(path=OUT / name, caret="initial")

    with room.hand("native", "--angle", "0"):
        ann.until(lambda: ann.force_of("native") > 0.5, "the native hand to press")
        look_at("watching")
        ann.page.keyboard.press("?")
        look_at("help")
        ann.page.keyboard.press("Escape")
        ann.press()
        ann.until(lambda: ann.force > 0.5, "a force")
        look_at("touching")
        ann.release()
        ann.page.click(".tour-button")
        ann.page.locator(".tour-foot button", has_text="Pause").click()
        look_at("tour")
        ann.page.keyboard.press("Escape")
    assert {state: problems for state, problems in found.items() if problems} == {}


def test_lost_graphics_come_back_as_they_were(visitors: Open, room: Room) -> None:
    ann = visitors(SMALL)
    # Kept before the page asks for its own.
    ann.page.add_init_script("""
      const get = HTMLCanvasElement.prototype.getContext;
      HTMLCanvasElement.prototype.getContext = function (...wanted) {
        const made = get.apply(this, wanted);
        if (wanted[0] === "webgl2") window.loses = made?.getExtension("WEBGL_lose_context");
        return made;
      };
    """)
    ann.visit(room.address)
    with room.hand("native", "--angle", "-80", "--depth-mm", "30"):
        ann.until(lambda: colour(ann) > COLOURED, "the dent")
        before = colour(ann)
        ann.page.evaluate("window.loses.loseContext()")
        ann.until(lambda: "graphics" in ann.notice, "word of it")
        ann.page.wait_for_timeout(500)
        ann.page.evaluate("window.loses.restoreContext()")
        ann.until(lambda: ann.notice == "", "the word to go")
        ann.until(lambda: abs(colour(ann) - before) < 0.1, "the picture to be what it was")
