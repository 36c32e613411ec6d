"""The last minute on the page: seen again, never as if it were now, with the own hand live."""

from __future__ import annotations

import os
import re
import signal

import pytest

from tests.browser.conftest import Open, Serve
from tests.browser.forces_shown import forces_around
from tests.browser.looking_back import (
    ago,
    heard_at,
    look_back,
    looks_of_before,
    replays,
    scrub,
    share,
    whole_picture,
)
from tests.browser.room import Room
from tests.browser.test_watch import difference, picture
from tests.browser.visitor import Look, Visitor

pytestmark = pytest.mark.live

PRESSES = ("--angle", "-80", "--depth-mm", "30", "--rhythm-s", "3")
RESTS = ("--angle", "-80", "--depth-mm", "30")


def test_what_was_seen_is_seen_again_and_life_goes_on_behind_it(visitors: Open, room: Room) -> None:
    ann = visitors(Look(1440, 900))
    with room.hand("native", *PRESSES):
        look_back(ann, room, 5.0)
        looks_of_before(ann)
        # By keys: a frame back, a second back, to the ends, on and still.
        scrub(ann, 0.5)
        ann.until(lambda: abs(share(ann) - 0.5) < 0.01, "half")
        ann.page.locator(".stage-host").focus()
        before = share(ann)
        ann.page.keyboard.press("ArrowLeft")
        ann.until(lambda: share(ann) < before, "a frame back")
        ann.page.keyboard.press("Home")
        ann.until(lambda: share(ann) == 0.0, "the beginning")
        ann.page.keyboard.press(" ")
        ann.until(lambda: 0.0 < share(ann) < 1.0, "it to play")
        ann.page.keyboard.press(" ")
        here = share(ann)
        ann.page.wait_for_timeout(500)
        assert share(ann) == pytest.approx(here, abs=0.05)
        # The same moment has the same picture and the same force, whatever was between.
        moment = heard_at(ann, "native")
        first, force = whole_picture(ann), ann.force_of("native")
        for key in ("End", "Home"):
            ann.page.keyboard.press(key)
            ann.page.wait_for_timeout(600)
        scrub(ann, moment)
        ann.until(lambda: difference(first, picture(ann)) < 0.02, "the same picture")
        ann.catch_up()
        assert ann.force_of("native") == pytest.approx(force, abs=0.011)
        looks_of_before(ann)
        # The plot reads the values of the shown time.
        words = ann.text(".card[data-user] .plot-words")
        assert words.startswith("Here: proxy "), words
        said = re.search(r"force ([\d.]+)", words)
        assert said is not None
        around = forces_around(ann, "native")
        assert min(around) - 0.06 < float(said[1]) < max(around) + 0.06
        ann.page.keyboard.press("Escape")
        ann.until(lambda: not replays(ann), "life")
        ann.until(ann.watches, "the lamp of now")
        ann.until(lambda: ann.force_of("native") > 0.1, "numbers of now")


def test_the_own_hand_lets_go_stays_in_the_room_and_its_force_is_of_now(
    visitors: Open, room: Room
) -> None:
    ann = visitors(Look(1440, 900))
    # Where the native hand has made a dent, the surface comes back against a finger beside it.
    with room.hand("native", *PRESSES):
        ann.visit(room.address)
        ann.until(lambda: ann.force_of("native") > 0.5, "the native hand to press")
        ann.take_part("ann")
        ann.press(right=0.2)
        ann.until(lambda: ann.force > 0.5, "a force")
        ann.page.wait_for_timeout(1500)
        ann.page.keyboard.press("b")
        ann.until(lambda: replays(ann), "the replay")
        # What is shown is a press of before; the dock is of now, where nothing is pressed.
        ann.until(lambda: ann.force == 0.0, "the hand to let go")
        for _ in range(40):
            assert ann.known_force() == 0.0
            ann.page.wait_for_timeout(100)
        ann.until(lambda: ann.doing() == "in the air", "the hand to be in the air")
        assert len(room.users()) == 2
        shares = iter(range(99, 0, -3))
        ann.until(lambda: pressed_at(ann, next(shares, 50) / 100.0), "the press of before")
        assert ann.known_force() == 0.0
        ann.release()
        # Nobody presses on a picture of before.
        ann.press()
        ann.page.wait_for_timeout(800)
        assert ann.known_force() == 0.0
        ann.release()
        ann.page.locator(".stage-host").focus()
        ann.page.keyboard.press("Escape")
        ann.until(lambda: not replays(ann), "life")
        ann.press()
        ann.until(lambda: ann.force > 0.5, "a force again")
        ann.release()


def pressed_at(visitor: Visitor, place: float) -> bool:
    """Whether the own hand pressed at a share of the recording."""
    scrub(visitor, place)
    visitor.catch_up()
    return visitor.force_of("ann (you)") > 0.5


def test_rubbish(visitors: Open, serve: Serve) -> None:
    """A server that dies, lost graphics, a hundred scrubs a second."""
    room = serve()
    ann = visitors()
    ann.page.add_init_script("""
      const get = HTMLCanvasElement.prototype.getContext;
      HTMLCanvasElement.prototype.getContext = function (...wanted) {
        const made = get.apply(this, wanted);
        if (wanted[0] === "webgl2") window.loses = made?.getExtension("WEBGL_lose_context");
        return made;
      };
    """)
    ann.away = True
    with room.hand("native", *RESTS):
        look_back(ann, room, 3.0)
        ann.page.evaluate("""() => {
          const line = document.querySelector(".replay-line");
          window.scrubs = setInterval(() => {
            line.value = Math.random();
            line.dispatchEvent(new Event("input"));
          }, 10);
        }""")
        ann.page.wait_for_timeout(1000)
        os.kill(room.pid, signal.SIGSTOP)
        ann.until(lambda: ann.notice != "", "word of the silence")
        looks_of_before(ann)
        ann.page.evaluate("window.loses.loseContext()")
        ann.until(lambda: "graphics" in ann.notice, "word of the graphics")
        ann.page.wait_for_timeout(300)
        ann.page.evaluate("window.loses.restoreContext()")
        ann.until(lambda: "graphics" not in ann.notice, "the word to go")
        ann.page.evaluate("clearInterval(window.scrubs)")
        heard_at(ann, "native")
        looks_of_before(ann)
        ann.page.keyboard.press("Escape")
        ann.until(lambda: not replays(ann), "the present, which is dead")
        assert "stale" in (ann.page.locator(".app").get_attribute("class") or "")
        # What came before it died can still be looked at.
        ann.page.locator(".stage-host").focus()
        ann.page.keyboard.press("b")
        ann.until(lambda: replays(ann), "the replay of a room that is dead")
        assert ago(ann) > 1.0
        os.kill(room.pid, signal.SIGCONT)
