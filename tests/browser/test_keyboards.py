"""Keys of keyboards with other letters, as Chromium tells the page of them."""

from __future__ import annotations

from typing import Any

import pytest

from tests.browser.conftest import Open
from tests.browser.room import Room
from tests.browser.visitor import Visitor

pytestmark = pytest.mark.live

CONTROL = 2  # of the modifiers in Chromium's protocol


class Keyboard:
    """Presses keys by what is printed on them and where they are.

    Args:
        visitor: Whose keyboard it is.
    """

    def __init__(self, visitor: Visitor) -> None:
        self._cdp: Any = visitor.page.context.new_cdp_session(visitor.page)

    def press(self, key: str, code: str, modifiers: int = 0) -> None:
        told = {"key": key, "code": code, "modifiers": modifiers}
        for kind in ("rawKeyDown", "keyUp"):
            self._cdp.send("Input.dispatchKeyEvent", {"type": kind, **told})


def test_keys_of_another_alphabet_and_of_a_german_keyboard_do_as_the_help_says(
    visitors: Open, room: Room
) -> None:
    ann = visitors()
    ann.visit(room.address)
    keyboard = Keyboard(ann)

    themes = ["light"]

    def changed() -> bool:
        seen = ann.page.locator("html").get_attribute("data-theme")
        return seen is not None and seen != themes[-1]

    for letter in ("\u0432", "\u03b4", "\u05d2", "\u064a"):  # on the D of a Latin keyboard
        keyboard.press(letter, "KeyD")
        ann.until(changed, f"day and night by {letter}")
        themes.append("dark" if themes[-1] == "light" else "light")
    keyboard.press("e", "KeyD")  # of Dvorak
    keyboard.press("\u0432", "KeyD", CONTROL)
    ann.catch_up()
    assert not changed()
    keyboard.press("\u0435", "KeyT")
    ann.until(lambda: ann.doing() == "in the air", "the hand to come by the key")
    ann.press()
    ann.until(lambda: ann.force > 0.5, "a force")
    first = ann.steady_force()
    for _ in range(3):
        keyboard.press("\u044a", "BracketRight")
    deeper = ann.steady_force()
    assert deeper > first
    for _ in range(3):
        keyboard.press("\u00fc", "BracketLeft")
    ann.until(lambda: ann.force < 0.5 * (first + deeper), "less force")
    ann.release()
    keyboard.press("\u0435", "KeyT")
    button = ann.page.locator(".touch-button")
    ann.until(lambda: button.get_attribute("aria-pressed") == "false", "the hand to leave")
    ann.page.focus(".name")
    keyboard.press("\u0435", "KeyT")  # is typed
    ann.catch_up()
    assert button.get_attribute("aria-pressed") == "false"
