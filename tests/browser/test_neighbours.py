"""In Engineer, the campaign's rooms like this one: seen, counted right, or said to be none."""

from __future__ import annotations

import contextlib
import json
import re
from dataclasses import replace
from pathlib import Path

import pytest

from cohaptic.protocol.scene import Scene
from tests.browser.conftest import Open
from tests.browser.room import Room
from tests.browser.visitor import SMALL

pytestmark = pytest.mark.live

TABLE = json.loads((Path(__file__).parents[2] / "web/src/control/campaign_rooms.json").read_text())
REACH = {"loop": (20, 0.25), "coupling": (10, 0.2), "lag": (20, 0.4)}
# Of a reach: what the page does not count anew for, and what a room at rest trembles by.
KEPT = 0.4
WORDS = ".neighbours-words"
_FACTS = re.compile(
    r"(?P<like>[\d,]+) of the campaign.s (?P<rooms>[\d,]+) runs with (?P<hands>\d) hands under the"
    r" predictive law (is|are) like this room \(loop (?P<loop>\d+) ms . \d+, coupling"
    r" (?P<coupling>[\d.]+) . [\d.]+, lag (?P<lag>\d+) ms . \d+\)\. (?P<verdict>.*)"
)


def like(hands: int, *facts: int) -> tuple[int, int]:
    """Rooms of the table like one with these facts, and of them the stable ones."""
    numbers = TABLE["outcomes"]["predictive"][hands - 1]
    rooms = [numbers[i : i + 6] for i in range(0, len(numbers), 6)]
    near = [
        room
        for room in rooms
        if all(
            abs(room[k] - fact) <= max(least, round(share * fact))
            for k, (fact, (least, share)) in enumerate(zip(facts, REACH.values(), strict=True))
        )
    ]
    return len(near), sum(room[3] == 0 for room in near)


def facts_of(found: re.Match[str]) -> tuple[int, int, int]:
    """Loop [ms], coupling [%] and lag [ms], as the page says them."""
    return int(found["loop"]), round(100 * float(found["coupling"])), int(found["lag"])


def of_room(found: re.Match[str], scene: Scene) -> bool:
    """Whether the page speaks of the two hands of this room."""
    here = (
        1e3 * max((user.loop_delay for user in scene.users), default=0.0),
        1e2 * scene.room.coupling,
        1e3 * scene.room.lag,
    )
    return int(found["hands"]) == len(scene.users) == 2 and all(
        told == pytest.approx(is_now, abs=KEPT * max(least, share * is_now) + 1.0)
        for told, is_now, (least, share) in zip(facts_of(found), here, REACH.values(), strict=True)
    )


def test_rooms_like_this_one_are_counted(visitors: Open, room: Room) -> None:
    with room.hand("left", "--angle", "180"), room.hand("right", "--angle", "0"):
        ann = visitors(replace(SMALL, engineer=False))
        asked: list[str] = []
        ann.page.on("request", lambda request: asked.append(request.url))
        ann.visit(room.address)
        ann.until(
            lambda: all(ann.force_of(name) > 1.0 for name in ("left", "right")), "both to press"
        )
        assert not ann.text(WORDS)
        assert not [url for url in asked if "neighbour" in url]
        ann.page.click(".level")
        looked_up: list[re.Match[str]] = []

        def this_room() -> bool:
            # On a busy machine loops change from one look to the next, and the page counts anew.
            ann.page.wait_for_timeout(250)  # each look of a watcher counts at the door
            found = _FACTS.match(ann.text(WORDS))
            if found is None or not of_room(found, newest(room)):
                return False
            looked_up[:] = [found]
            return True

        # It is this room that was looked up ...
        ann.until(this_room, "the neighbours of this room")
        (found,) = looked_up
        # ... and the numbers are the table's.
        facts = facts_of(found)
        count, stable = like(2, *facts)
        assert int(found["like"]) == count > 0
        assert int(found["rooms"].replace(",", "")) == len(TABLE["outcomes"]["predictive"][1]) // 6
        assert stable == count
        assert found["verdict"].startswith(("All", "It was stable"))
        ann.page.click(".neighbours-how summary")
        assert TABLE["command"] in ann.text(".neighbours-how")


def newest(room: Room) -> Scene:
    with contextlib.closing(room.whole_scenes()) as scenes:
        return next(scenes)
