"""A full room on a phone: everybody has a colour and a name, and no name lies on another."""

from __future__ import annotations

from functools import partial

import pytest

from tests.browser.conftest import Open
from tests.browser.crowd import crowd
from tests.browser.room import Room
from tests.browser.test_sizes import OUT
from tests.browser.visitor import Look, Visitor, at_night

pytestmark = pytest.mark.live

# Written to the left, of several characters each to the eye, as wide as they come, of two scripts.
NAMES = (
    "שלום עולם", "مرحبا بالعالم", "שלום 12", "\U0001f469\U0001f3fd astro",
    "\U0001f9a6" * 32, "Z\u0351\u036ba\u0334l\u0335g\u0336o\u0337\u0338", "李小龍", "W" * 32,
    "a" * 31, "Anna-Magdalena von Hohenzollern", "Ω≈ç√∫",
    "\U0001d571\U0001d597\U0001d586\U0001d590", "7", "bob", "user 9",
)  # fmt: skip
# Pairs of names on the stage that lie on one another, and names that lie outside of what is free.
# Those are placed in the picture after the one in which bar or dock became another size.
_IN_THE_WAY = """async () => {
  const box = (node) => node.getBoundingClientRect();
  const edges = () => [".bar", ".dock"].map((name) => box(document.querySelector(name)))
    .flatMap(({ top, bottom }) => [top, bottom]).join();
  const frame = () => new Promise((done) => requestAnimationFrame(done));
  for (let before = ""; before !== edges(); ) {
    before = edges();
    await frame();
    await frame();
  }
  const seen = [...document.querySelectorAll(".label")]
    .filter((node) => node.checkVisibility({ visibilityProperty: true })).map(box);
  const over = (a, b) => a.left < b.right - 1 && b.left < a.right - 1
    && a.top < b.bottom - 1 && b.top < a.bottom - 1;
  const [bar, dock] = [".bar", ".dock"].map((name) => box(document.querySelector(name)));
  const pairs = seen.flatMap((a, i) => seen.slice(i + 1).filter((b) => over(a, b)));
  return {
    seen: seen.length,
    pairs: pairs.length,
    outside: seen.filter((a) => a.left < 0 || a.right > innerWidth
      || a.top < bar.bottom - 1 || a.bottom > dock.top + 1).length,
  };
}"""
# Of each card, whether its name lies to the left of its force and neither is outside.
_ROWS = """() => [...document.querySelectorAll(".card[data-user]")].filter((card) => {
  const [name, force] = [".card-name", ".card-force"]
    .map((part) => card.querySelector(part).getBoundingClientRect());
  return !(name.left >= 0 && name.right <= force.left + 0.5 && force.right <= innerWidth);
}).length"""


def colours(visitor: Visitor) -> list[str]:
    found: list[str] = visitor.page.locator(".card .swatch").evaluate_all(
        "(all) => all.map((node) => getComputedStyle(node).backgroundColor)"
    )
    return found


def stands_still(visitor: Visitor) -> None:
    """Wait until the view does, where dock and bar leave room for it, and names with it."""
    canvas = visitor.page.locator(".stage-canvas")
    views: list[list[str | None]] = [[]]

    def still() -> bool:
        visitor.catch_up()
        views.append([canvas.get_attribute(f"data-{name}") for name in ("view", "lift", "lean")])
        return len(views) > 3 and views[-1] == views[-2] == views[-3]

    visitor.page.wait_for_timeout(500)
    visitor.until(still, "the view to stand still")


def names_are_seen(visitor: Visitor) -> bool:
    """Whether half of them are, none in the way of another.

    A hand of which a busy machine lets nothing be heard for half a second fades, and its name with
    it.
    """
    found = visitor.page.evaluate(_IN_THE_WAY)
    assert (found["pairs"], found["outside"]) == (0, 0), found
    return bool(found["seen"] >= len(NAMES) / 2)


@pytest.mark.parametrize(
    "look",
    [Look(390, 844, phone=True, engineer=False), at_night(Look(1280, 800))],
    ids=["phone", "window"],
)
def test_sixteen_have_a_colour_and_a_name_each_that_can_be_read(
    visitors: Open, room: Room, look: Look
) -> None:
    ann = visitors(look)
    ann.visit(room.address)
    with crowd(room.url, NAMES):
        ann.until(lambda: len(colours(ann)) == len(NAMES), "everybody to be here")
        ann.take_part("ann")
        ann.press(right=0.1)
        ann.until(lambda: ann.force > 0.2, "a force")
        ann.until(lambda: len(colours(ann)) == len(NAMES) + 1, "the own card")
        assert len(set(colours(ann))) == len(NAMES) + 1
        for _ in range(4):
            stands_still(ann)
            ann.until(partial(names_are_seen, ann), "half of the names at least")
            ann.turn(0.6)
        stands_still(ann)
        # One's own is there, whoever else is.
        own = ".label-name:text-is('ann (you)')"
        ann.until(lambda: ann.text(own) == "ann (you)", "the own name")
        OUT.mkdir(parents=True, exist_ok=True)
        ann.page.screenshot(path=OUT / f"crowd-{look.width}.png", caret="initial")
        ann.release()
        handle = ann.page.locator(".sheet-handle")
        if handle.is_visible():
            handle.click()
            ann.page.wait_for_timeout(400)
            ann.catch_up()
            ann.page.screenshot(path=OUT / f"crowd-sheet-{look.width}.png", caret="initial")
        assert ann.page.evaluate(_ROWS) == 0
