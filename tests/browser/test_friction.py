"""A finger that sticks: the page asks for friction, and who drags the surface drags it along."""

from __future__ import annotations

import math

import pytest

from tests.browser.conftest import Open
from tests.browser.room import Room

pytestmark = pytest.mark.live

# Beside ann's place in the first view; it drags the surface out and back.
DRAGS = ("--angle", "-60", "--friction", "0.8", "--drag-mm", "25", "--rhythm-s", "4")


def test_a_finger_that_sticks_is_dragged_along_and_a_smooth_one_is_not(
    visitors: Open, room: Room
) -> None:
    ann = visitors()
    ann.visit(room.address)
    ann.take_part("ann")
    assert not any(user.friction for user in room.users().values())
    ann.choose_friction("0.8")
    room.until(lambda users: any(user.friction for user in users.values()), "the rough finger")
    ann.press(right=0.1, up=0.1)
    ann.steady_force()
    alone = ann.along
    assert math.isfinite(alone)
    with room.hand("native", *DRAGS):
        ann.until(lambda: abs(ann.along - alone) > 0.25, "ann to be dragged")
        # What the page feels is what the body carries, in all directions.
        ann.until(lambda: abs(ann.force_of("ann (you)") - ann.force) < 0.1, "the panel to know it")

        ann.release()
        ann.until(lambda: ann.force == 0.0, "the rough finger to be off")
        ann.choose_friction("Smooth")
        room.until(
            lambda users: sorted(user.friction for user in users.values()) == [False, True],
            "the smooth finger",
        )
        ann.press(right=0.1, up=0.1)
        ann.until(lambda: ann.force > 1.0, "ann to press again")
        assert math.isnan(ann.along)
