"""What axe-core finds on the page: nothing, in any window, theme and state; and lost graphics."""

from __future__ import annotations

import os
import signal
from dataclasses import replace
from pathlib import Path
from typing import Literal

import pytest

from tests.browser.conftest import Open
from tests.browser.room import Room
from tests.browser.test_sizes import OUT
from tests.browser.visitor import Look, Visitor, at_night
from tests.give_up import give_up

pytestmark = pytest.mark.live

AXE = Path(__file__).parents[2] / "web" / "node_modules" / "axe-core" / "axe.min.js"
# The extremes in every run of all tests, those between at night.
LARGE = Look(1440, 900)
SIZES = [
    *(Look(390, 844, phone=True), LARGE),
    *(at_night(look) for look in (Look(820, 1180), Look(1024, 700))),
]
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


class Looks:
    """What axe-core finds of a page in one state after another, in all themes; with pictures."""

    def __init__(self, visitor: Visitor, look: Look) -> None:
        if not AXE.is_file():
            give_up("axe-core is not here: npm ci in web/")
        self.visitor, self.look = visitor, look
        self.found: dict[str, list[str]] = {}
        # The page's policy lets in no script of others; the test's own world is not asked.
        visitor.page.add_init_script(path=AXE)
        OUT.mkdir(parents=True, exist_ok=True)

    def at(self, state: str) -> None:
        """Look at the page as it is now."""
        themes: tuple[Theme, ...] = ("light", "dark", "forced")
        for theme in themes:
            problems = violations(self.visitor, theme)
            if problems:
                self.found[f"{state}, {theme}"] = problems
            name = f"access-{self.look.width}-{state}-{theme}.png"
            self.visitor.page.screenshot(path=OUT / name, caret="initial")


@pytest.mark.parametrize("look", SIZES, ids=str)
def test_axe_finds_nothing(visitors: Open, room: Room, look: Look) -> None:
    ann = visitors(look)
    looks = Looks(ann, look)
    ann.visit(room.address)
    with room.hand("native", "--angle", "0"):
        ann.until(lambda: ann.force_of("native") > 0.5, "the native hand to press")
        looks.at("watching")
        ann.page.keyboard.press("?")
        ann.until(ann.page.locator("dialog[open]").is_visible, "the help")
        looks.at("help")
        ann.page.keyboard.press("Escape")
        ann.press()
        ann.until(lambda: ann.force > 0.5, "a force")
        looks.at("touching")
        ann.release()
        ann.page.click(".tour-button")
        ann.page.locator(".tour-foot button", has_text="Pause").click()
        looks.at("tour")
        ann.page.keyboard.press("Escape")
    assert looks.found == {}


@pytest.mark.parametrize("look", [SIZES[0], at_night(LARGE), *SIZES[2:]], ids=str)
def test_axe_finds_nothing_in_what_comes_when_it_is_asked_for(
    visitors: Open, room: Room, look: Look
) -> None:
    """The replay, the line of company, the dialogs, and a server that is silent."""
    ann = visitors(replace(look, engineer=False))
    looks = Looks(ann, look)
    ann.visit(room.address)
    stage = ann.page.locator(".stage-host")
    with room.hand("native", "--angle", "0", "--rhythm-s", "3"):
        ann.until(lambda: ann.force_of("native") > 0.5, "the native hand to press")
        for button, state in (("Invite", "share"), ("Use a gamepad", "gamepad")):
            ann.page.get_by_role("button", name=button).click()
            ann.until(ann.page.locator("dialog[open]").is_visible, f"the dialog of {state}")
            looks.at(state)
            ann.page.keyboard.press("Escape")
        handle = ann.page.locator(".sheet-handle")
        if handle.is_visible():
            handle.click()
        ann.page.click(".company-point")
        if handle.is_visible():
            handle.click()
        ann.until(lambda: ann.text(".pill-words") == "Press where you want to point.", "the line")
        # One gesture at a time is asked for.
        assert ann.text(".ghost") == ""
        looks.at("company")
        ann.page.get_by_role("button", name="Cancel").click()
        stage.focus()
        ann.page.keyboard.press("l")
        ann.page.keyboard.press("b")
        ann.until(lambda: ann.text(".replay-tag") == "Replay", "the replay")
        looks.at("replay")
        stage.focus()
        ann.page.keyboard.press("Escape")
        os.kill(room.pid, signal.SIGSTOP)
        try:
            ann.until(lambda: "No word from the server" in ann.notice, "the notice")
            ann.away = True  # it gives the connection up, and tries anew
            # The bar may have looked at the clock just before the notice did.
            ann.until(lambda: ann.text(".replay-tag") == "No word", "the bar to say so too")
            looks.at("silent")
        finally:
            os.kill(room.pid, signal.SIGCONT)
    assert looks.found == {}
