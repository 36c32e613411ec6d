"""Laws of a tip that a script moves."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.vec import Vec3, norm, sub
from cohaptic_client.devices.catalogue import names, open_device, read_device
from cohaptic_client.devices.scripted import MAX_SPEED, SCRIPTED, TARGET, ScriptedTip

COORDINATE = st.floats(-0.3, 0.3)
POINT = st.tuples(COORDINATE, COORDINATE, COORDINATE)
PERIOD = 0.001  # s


class Script:
    """A script whose tip is read a thousand times a second."""

    def __init__(self, start: Vec3 = (0.0, 0.0, 0.0)) -> None:
        self.tip = ScriptedTip(start)
        self.waiting = list[bytes]()
        self.tip.bind(lambda: self.waiting.pop() if self.waiting else None)
        self.now = 5.0

    def move_to(self, point: Vec3, seconds: float = 0.0) -> None:
        self.waiting = [TARGET.pack(*point, seconds)]

    def run(self, seconds: float) -> list[Vec3]:
        places = list[Vec3]()
        for _ in range(round(seconds / PERIOD)):
            self.now += PERIOD
            places.append(self.tip.read(self.now).position)
        return places


@given(targets=st.lists(st.tuples(POINT, st.floats(0.0, 0.3), st.floats(0.0, 0.2)), max_size=4))
def test_it_never_jumps_and_comes_to_rest_at_the_last_target(
    targets: list[tuple[Vec3, float, float]],
) -> None:
    script = Script()
    places = script.run(0.01)
    for point, seconds, until in targets:
        script.move_to(point, seconds)
        places += script.run(until)
    places += script.run(3.0)
    steps = [norm(sub(b, a)) for a, b in pairwise(places)]
    # A goal that turns round takes the follower a little beyond the goal's own speed.
    assert max(steps) <= 1.5 * MAX_SPEED * PERIOD
    end = targets[-1][0] if targets else (0.0, 0.0, 0.0)
    assert places[-1] == pytest.approx(end, abs=1e-6)


def test_it_begins_where_the_script_says_before_the_first_period() -> None:
    script = Script((1.0, 0.0, 0.0))
    script.move_to((0.0, 0.2, 0.0))
    assert script.run(PERIOD) == [pytest.approx((0.0, 0.2, 0.0))]


def test_a_way_takes_the_time_that_the_script_gives_it() -> None:
    script = Script()
    script.run(0.01)
    script.move_to((0.1, 0.0, 0.0), 1.0)
    places = script.run(1.2)
    assert places[499][0] == pytest.approx(0.05, abs=0.005)  # half of it, and 20 ms behind
    assert places[1100][0] == pytest.approx(0.1, abs=1e-4)


@given(force=st.tuples(*[st.floats(-20.0, 20.0)] * 3), pause=st.floats(0.0, 2.0))
def test_no_force_and_no_pause_moves_it(force: Vec3, pause: float) -> None:
    script = Script((0.1, 0.0, 0.0))
    script.run(0.01)
    script.tip.write(force)
    script.now += pause
    assert script.run(0.1)[-1] == pytest.approx((0.1, 0.0, 0.0))


def test_users_of_the_command_line_do_not_see_it() -> None:
    assert SCRIPTED.name not in names()
    assert read_device("scripted") == SCRIPTED
    assert math.isfinite(sum(open_device_start()))


def open_device_start() -> Vec3:
    from cohaptic.simulated.hand import Hand
    from cohaptic_client.devices.kind import DeviceConfig

    config = DeviceConfig(SCRIPTED, (1.0, 0.0, 0.0), 0.1, Hand(), None)
    place = open_device(config).read(0.0).position
    assert norm(sub(place, config.center)) > config.radius
    return place
