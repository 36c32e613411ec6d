"""The first press is the way in: by mouse, by finger and by keys alone."""

from __future__ import annotations

import itertools

import pytest

from tests.browser.conftest import Open
from tests.browser.room import Room
from tests.browser.visitor import PHONE, Look

pytestmark = pytest.mark.live

NEW = Look(640, 480, engineer=False)


@pytest.mark.parametrize("look", [NEW, PHONE], ids=["window", "phone"])
def test_who_presses_is_in(visitors: Open, room: Room, look: Look) -> None:
    ann = visitors(look)
    ann.visit(room.address)
    ann.until(lambda: "Press here" in ann.text(".ghost"), "the gesture to be shown")
    ann.press(right=0.1)
    ann.until(lambda: ann.force > 0.5, "a force by one press")
    room.until(
        lambda users: [sum(x * x for x in user.force) > 0.2 for user in users.values()] == [True],
        "the server to have it from one hand",
    )
    assert ann.text(".ghost") == ""
    ann.release()
    ann.until(lambda: not ann.force > 0.0, "the force to end")
    # Who knows it is shown it no more.
    ann.page.reload()
    ann.until(ann.watches, "the page to watch")
    ann.page.wait_for_timeout(300)
    assert ann.text(".ghost") == ""


def test_by_keys_alone_from_the_address_bar_to_a_force(visitors: Open, room: Room) -> None:
    ann = visitors(NEW)
    ann.visit(room.address)
    focused = "document.activeElement?.className ?? ''"
    for _ in itertools.takewhile(
        lambda _: "stage-host" not in ann.page.evaluate(focused), range(20)
    ):
        ann.page.keyboard.press("Tab")
    assert "stage-host" in ann.page.evaluate(focused)
    ann.page.keyboard.down(" ")
    ann.until(lambda: ann.force > 0.5, "a force by keys")
    assert len(room.users()) == 1
    ann.page.keyboard.up(" ")
    ann.until(lambda: not ann.force > 0.0, "the force to end")
    ann.page.keyboard.press("Escape")
    room.until(lambda users: users == {}, "the hand to leave")
