"""Somebody brings another object while one looks back: that goes on, and then comes the new one."""

from __future__ import annotations

import pytest

from tests.browser.conftest import Open, Serve
from tests.browser.looking_back import (
    heard_at,
    look_back,
    looks_of_before,
    replays,
    scrub,
    whole_picture,
)
from tests.browser.test_upload import drop, own_store, shown
from tests.browser.test_watch import difference, picture
from tests.browser.visitor import Look
from tests.uploads.test_worker import block_vtu

pytestmark = pytest.mark.live

# Not `patient`: the process of an upload stands back for other tests, and would wait for their end.
__all__ = ["own_store"]  # a fixture of every test here: nothing is left in the user's store


def test_an_object_that_is_exchanged_behind_a_replay_waits_there_and_is_touched_after_it(
    visitors: Open, serve: Serve
) -> None:
    room = serve("--allow-upload")
    ann, ben = visitors(Look(1024, 720)), visitors()
    with room.hand("native", "--angle", "-80", "--depth-mm", "30"):
        ben.visit(room.address)
        look_back(ann, room, 2.0)
        ann.take_part("ann")
        moment = heard_at(ann, "native")
        before, force = whole_picture(ann), ann.force_of("native")
        drop(ben, "my block.vtu", block_vtu(4))
        ben.until(lambda: shown(ben), "the object to be shown")
        ben.page.locator(".upload-foot .primary").first.click()
        ben.until(lambda: "everybody" in ben.text(".upload-words"), "the object to be served")
        ann.until(lambda: ann.doing() == "in the air", "the hand to be in the new room")
        # Still the picture and the numbers of before, on any of its times, and said to be that.
        looks_of_before(ann)
        ann.until(lambda: difference(before, picture(ann)) < 0.02, "the picture of before")
        scrub(ann, 0.1)
        ann.page.wait_for_timeout(400)
        scrub(ann, moment)
        ann.until(lambda: abs(ann.force_of("native") - force) < 0.011, "the force of before")
        ann.until(lambda: difference(before, picture(ann)) < 0.02, "the picture of before")
        # Nobody presses on it, neither the object of before nor the one of now.
        ann.press()
        ann.page.wait_for_timeout(600)
        assert ann.known_force() == 0.0
        ann.release()
        ann.page.locator(".stage-host").focus()
        ann.page.keyboard.press("Escape")
        ann.until(lambda: not replays(ann), "life")
        ann.until(lambda: ann.text(".room").startswith("my-block-"), "the name of the new object")
        ann.until(lambda: difference(before, picture(ann)) > 0.05, "its picture")
        ann.press()
        ann.until(lambda: ann.force > 0.1, "a force from it")
        ann.release()
        for visitor in (ann, ben):
            visitor.away = True  # the server ends before the pages
