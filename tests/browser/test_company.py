"""Who else is here: how many watch, whose view is followed, who points; by mouse and by keys."""

from __future__ import annotations

import pytest

from tests.browser.conftest import Open
from tests.browser.room import Room
from tests.browser.test_sizes import OUT
from tests.browser.visitor import SMALL, Look, Visitor

pytestmark = pytest.mark.live

PEOPLE = Look(SMALL.width, SMALL.height, engineer=False)


def follow(visitor: Visitor, name: str) -> None:
    """Press the button of somebody's card."""
    button = visitor.page.get_by_role("button", name=f"Follow {name}", exact=True)
    visitor.until(button.is_visible, f"a view of {name} to follow")
    button.click()
    visitor.until(lambda: visitor.text(".pill-words") == f"You see what {name} sees.", "it")


def apart(one: Visitor, other: Visitor) -> float:
    """How far two pages look from different directions [degrees], or from different distances."""
    (azimuth, *rest), (other_azimuth, *other_rest) = view_of(one), view_of(other)
    turned = abs((azimuth - other_azimuth + 180.0) % 360.0 - 180.0)
    return turned + sum(abs(a - b) for a, b in zip(rest, other_rest, strict=True))


def view_of(visitor: Visitor) -> list[float]:
    """From where the picture on the screen was taken: azimuth, elevation [degrees], distance."""
    words = visitor.page.locator(".stage-canvas").get_attribute("data-view") or ""
    return [float(word) for word in words.split()]


def test_a_view_is_followed_until_it_is_turned_and_may_be_refused(
    visitors: Open, room: Room
) -> None:
    ann, bob = visitors(PEOPLE), visitors(PEOPLE)
    ann.visit(room.address)
    ann.take_part("ann")
    bob.visit(f"{room.address}?name=bob")
    bob.until(lambda: bob.text(".company-watching") == "1 watching", "bob to be counted")
    follow(bob, "ann")
    ann.until(lambda: ann.text(".pill-words") == "bob (watching) sees what you see.", "word of it")
    for page in (ann, bob):
        page.page.screenshot(path=OUT / f"follow-{'ann' if page is ann else 'bob'}.png")
    before = view_of(bob)
    ann.turn(1.2)
    ann.until(lambda: abs(view_of(ann)[0] - before[0]) > 68.0, "ann's view to have turned")
    ann.until(lambda: apart(ann, bob) < 0.3, "the same view")
    assert abs(view_of(bob)[0] - before[0]) > 60.0
    # A turn of one's own ends it, and the other is told.
    bob.turn(-0.6)
    bob.until(lambda: bob.text(".pill") == "", "the end")
    bob.until(lambda: apart(ann, bob) > 30.0, "bob's own view")
    ann.until(lambda: ann.text(".pill") == "", "word of the end")
    follow(bob, "ann")
    ann.page.get_by_role("button", name="Keep my view to myself").click()
    bob.until(lambda: bob.text(".pill-words") == "ann keeps its view to itself.", "the refusal")
    bob.until(lambda: not bob.page.locator(".card-follow").is_visible(), "no button any more")
    assert not ann.page.get_by_label("Others may follow my view").is_checked()
    ann.page.get_by_label("Others may follow my view").check()
    follow(bob, "ann")
    ann.leave()
    bob.until(lambda: bob.text(".for-ears") == "ann has left.", "word that ann has left")
    bob.until(lambda: not bob.text(".pill-words").startswith("You see"), "the view to be bob's own")
