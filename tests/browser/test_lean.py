"""The camera eases off the normal of a press and back, and moves no hand by it."""

from __future__ import annotations

import math

import pytest

from cohaptic.protocol.scene_users import UserRecord
from tests.browser.conftest import Open
from tests.browser.room import Room
from tests.browser.visitor import PHONE, Look, Visitor

pytestmark = pytest.mark.live

WIDE = Look(1024, 720)
LARGEST = 30.0  # degrees (web/src/view/pointing/lean.ts)
SAME = 1e-3  # m; places are those of the surface as others and the own dent have it


def lean(visitor: Visitor) -> float:
    """By how much the picture leans [degrees]."""
    said = visitor.page.locator(".stage-canvas").get_attribute("data-lean")
    return abs(float(said or "0"))


def hand(room: Room) -> UserRecord:
    (user,) = room.users().values()
    return user


def pressing(visitor: Visitor, room: Room, *, still: bool = False) -> tuple[float, float]:
    """A visitor who presses in the middle of what it sees; where its pointer is [px]."""
    if still:
        visitor.page.emulate_media(reduced_motion="reduce")
    visitor.visit(room.address)
    visitor.take_part("ann")
    visitor.until(lambda: lifted(visitor), "the picture to be where dock and bar leave room")
    x, y = visitor.press()
    visitor.until(lambda: visitor.force > 0.5, "a force")
    visitor.steady_force()
    return x, y


def lifted(visitor: Visitor) -> bool:
    said = visitor.page.locator(".stage-canvas").get_attribute("data-lift")
    free = 0.5 * (visitor.height(".dock") - visitor.height(".bar"))
    return said is not None and abs(float(said) - free) < 2.0


def leant(visitor: Visitor) -> None:
    visitor.until(lambda: lean(visitor) == pytest.approx(LARGEST, abs=12.0), "the camera to lean")
    seen: list[float] = [math.nan]

    def rests() -> bool:
        visitor.catch_up()  # of a page that does not draw it rests as well
        seen.append(lean(visitor))
        return seen[-1] == seen[-2]

    visitor.until(rests, "the camera to rest")


def resting(visitor: Visitor, room: Room) -> UserRecord:
    """The hand once it stays where it is."""
    places = [hand(room)]

    def stays() -> bool:
        visitor.page.wait_for_timeout(250)
        visitor.catch_up()  # with each picture the hand is told where to go
        places.append(hand(room))
        return gap(places[-1], places[-2]) < 0.1 * SAME

    visitor.until(stays, "the hand to stay")
    return places[-1]


def gap(a: UserRecord, b: UserRecord) -> float:
    return math.dist(a.foot, b.foot)


@pytest.mark.parametrize("look", [WIDE, PHONE], ids=["wide", "phone"])
def test_a_press_is_seen_from_beside_and_then_as_before(
    visitors: Open, room: Room, look: Look
) -> None:
    ann = visitors(look)
    x, y = pressing(ann, room)
    first = hand(room)
    leant(ann)
    assert lean(ann) > 20.0
    # The hand has not moved with the picture, nor does it for a pointer that trembles by a pixel.
    assert gap(hand(room), first) < SAME
    # The dock, which grows with the first press, moves the whole picture, lean or not.
    for way in (1.0, -1.0, 0.0):
        ann.page.mouse.move(x + way, y)
    ann.page.wait_for_timeout(400)
    assert gap(hand(room), first) < SAME
    ann.release()
    ann.until(lambda: lean(ann) == 0.0, "the camera to come back")


def test_the_next_press_goes_where_one_sees_it(visitors: Open, room: Room) -> None:
    """Also while the camera is on its way back: it presses what is under the pointer, and stays."""
    ann = visitors(WIDE)
    pressing(ann, room)
    leant(ann)
    first = hand(room)
    ann.release()
    # What is seen of the dent until it has gone lies beside the ray by which it was pressed.
    ann.until(lambda: ann.force_of("ann (you)") < 0.01, "the surface to come back")
    ann.press()
    ann.until(lambda: ann.force > 0.5, "a force")
    # The picture turns about the place that was pressed, which is under the pointer all the time.
    assert gap(hand(room), first) < 2.0 * SAME
    leant(ann)
    assert gap(hand(room), first) < 2.0 * SAME
    ann.release()
    ann.until(lambda: lean(ann) == 0.0, "the camera to come back")
