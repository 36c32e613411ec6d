"""Two phones on one object, by fingers: one follows the other, one drops off the network."""

from __future__ import annotations

from typing import Any

import pytest

from tests.browser.conftest import Open
from tests.browser.room import Room
from tests.browser.test_company import apart, view_of
from tests.browser.test_silence import lamp, looks_dead, network
from tests.browser.test_sizes import OUT
from tests.browser.visitor import PHONE, Visitor

pytestmark = pytest.mark.live

STEPS = 12  # of a finger that moves
# What lies over a part, where it should lie beside it.
_OVER = """(part) => {
  const box = document.querySelector(part).getBoundingClientRect();
  return [".bar", ".legend", ".dock-main"].filter((other) => {
    const { left, right, top, bottom } = document.querySelector(other).getBoundingClientRect();
    return left < box.right && right > box.left && top < box.bottom && bottom > box.top;
  });
}"""

_STAGE = "([x, y]) => (document.elementFromPoint(x, y)?.closest('.stage-host') ?? null) !== null"


class Finger:
    """One finger on a phone's glass, as the browser's own protocol has it."""

    def __init__(self, visitor: Visitor) -> None:
        self._visitor = visitor
        self._cdp: Any = visitor.page.context.new_cdp_session(visitor.page)
        self._at = (0.0, 0.0)

    def down(self, x: float, y: float) -> None:
        self._at = (x, y)
        self._say("touchStart", [{"x": x, "y": y}])

    def move(self, x: float, y: float) -> None:
        """In steps, as fingers do."""
        (x0, y0), self._at = self._at, (x, y)
        for k in range(1, STEPS + 1):
            place = {"x": x0 + k / STEPS * (x - x0), "y": y0 + k / STEPS * (y - y0)}
            self._say("touchMove", [place])
            self._visitor.page.wait_for_timeout(16)

    def up(self) -> None:
        self._say("touchEnd", [])

    def _say(self, kind: str, points: list[dict[str, float]]) -> None:
        self._cdp.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})


def middle(visitor: Visitor) -> tuple[float, float]:
    """Where the object is: in the middle of what bar and dock leave free of the stage [px]."""
    box = visitor.page.locator(".stage-canvas").bounding_box()
    assert box is not None
    covered = visitor.height(".dock") - visitor.height(".bar")
    return box["x"] + 0.5 * box["width"], box["y"] + 0.5 * (box["height"] - covered)


# One story, told in the order in which it happens to two people.
def test_two_phones_touch_one_follows_and_one_drops_off_the_network_and_returns(
    visitors: Open, room: Room
) -> None:
    with network(room.port) as (port, swallows):
        ann, bob = visitors(PHONE), visitors(PHONE)
        anns, bobs = Finger(ann), Finger(bob)
        ann.visit(f"{room.address}?name=ann")
        bob.visit(f"http://127.0.0.1:{port}/?name=bob")
        # The first press of a finger is the way in, on both.
        anns.down(*middle(ann))
        ann.until(lambda: ann.force > 0.5, "ann to feel the object")
        anns.up()
        ann.until(lambda: ann.force == 0.0, "ann to let go")
        bob.page.tap(".sheet-handle")
        follow = bob.page.get_by_role("button", name="Follow ann", exact=True)
        bob.until(follow.is_visible, "a view to follow")
        follow.tap()
        bob.page.tap(".sheet-handle")
        bob.until(lambda: bob.text(".pill-words") == "You see what ann sees.", "bob to follow")
        # ann turns the view by a finger beside the object, and bob's goes along.
        before = view_of(bob)
        x, y = middle(ann)
        anns.down(0.06 * PHONE.width, y)
        anns.move(0.5 * PHONE.width, y)
        anns.up()
        ann.until(lambda: abs(view_of(ann)[0] - before[0]) > 20.0, "ann's view to turn")
        ann.until(lambda: apart(ann, bob) < 0.3, "the same view")
        # Both press, side by side; that ends no view that is followed.
        anns.down(x - 40.0, y)
        ann.until(lambda: ann.force > 0.5, "ann to press")
        bobs.down(middle(bob)[0] + 40.0, middle(bob)[1])
        bob.until(lambda: bob.force > 0.5, "bob to press")
        assert bob.text(".pill-words") == "You see what ann sees."
        assert bob.page.evaluate(_OVER, ".pill .button") == []
        # Whatever floats over the stage, a finger on the object is one on the stage.
        for right in (-90.0, 0.0, 90.0):
            x_b, y_b = middle(bob)
            assert bob.page.evaluate(_STAGE, [x_b + right, y_b]), right
        # His first: hers may stand still before his has reached her.
        bobs_force, together = bob.steady_force(), ann.steady_force()
        OUT.mkdir(parents=True, exist_ok=True)
        for name, page in (("ann", ann), ("bob", bob)):
            page.page.screenshot(path=OUT / f"two-phones-{name}.png", caret="initial")
        bob.away = True
        swallows.set()
        bob.until(lambda: lamp(bob) != "watching", "word of the silence")
        bob.until(lambda: bob.text(".dock-force") == "\u2013", "the own force to be unknown")
        looks_dead(bob)
        assert bob.page.evaluate(_OVER, ".notice") == []
        bob.page.screenshot(path=OUT / "two-phones-dropped.png", caret="initial")
        # A hand that is lost lets go of the object for everybody else, and ann goes on.
        ann.until(lambda: abs(ann.force - together) > 0.02, "ann to feel that bob is gone")
        alone = ann.steady_force()
        assert abs(alone - together) > 0.02
        ann.until(lambda: lamp(ann) == "watching", "ann to watch on")
        swallows.clear()
        bob.until(lambda: bob.watches() and bob.notice == "", "the page to come back")
        # The finger never left the glass: the hand is back where it was, and so are all forces.
        bob.until(
            lambda: (
                (bob.force, ann.force) == pytest.approx((bobs_force, together), rel=0.05, abs=0.03)
            ),
            "the forces of before",
        )
        bob.until(lambda: bob.text(".pill-words") == "You see what ann sees.", "it to follow again")
        assert len(room.users()) == 2
        for finger in (anns, bobs):
            finger.up()
        ann.until(lambda: ann.force == bob.force == 0.0, "both to let go")
