"""The last minute on the page: seen again, never as if it were now, with the own hand live."""

from __future__ import annotations

import re

import pytest

from tests.browser.conftest import Open
from tests.browser.forces_shown import forces_around
from tests.browser.looking_back import (
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
from tests.browser.visitor import Look

pytestmark = pytest.mark.live

PRESSES = ("--angle", "-80", "--depth-mm", "30", "--rhythm-s", "3")


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
