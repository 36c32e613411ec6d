from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.errors import SettingError
from cohaptic.vec import ZERO, Vec3, norm, scale, sub
from cohaptic_client.devices.device import DeviceInfo, DeviceSample
from cohaptic_client.devices.kind import DeviceChoice, DeviceConfig
from cohaptic_client.devices.placing.options import PLACING_OPTIONS, place, placed_info
from cohaptic_client.devices.placing.placed import LOSS_TIME, RETURN_TIME, Placed, return_time
from cohaptic_client.devices.placing.workspace import Workspace
from tests.client.plane import CONFIG
from tests.strategies import vectors

INFO = DeviceInfo("arm", max_force=3.0, max_stiffness=500.0, switch=True)
PERIOD = 0.001
PUSH: Vec3 = (1.0, 2.0, -2.0)
TIGHT = 1e-9
CLUTCH = 2
motion = st.lists(st.tuples(vectors(0.2), st.booleans()), min_size=1, max_size=20)


class Arm:
    """A raw device that is where a test puts it."""

    def __init__(self) -> None:
        self.info = INFO
        self.position, self.buttons, self.fresh = ZERO, 0, True
        self.force, self.closed = ZERO, False

    def read(self, now: float) -> DeviceSample:
        return DeviceSample(self.position, (0.1, 0.0, 0.0), 0.0, self.buttons, self.fresh)

    def write(self, force: Vec3) -> None:
        self.force = force

    def release(self) -> None:
        self.force = ZERO

    def close(self) -> None:
        self.closed = True


def played(
    placed: Placed, arm: Arm, way: Iterable[tuple[Vec3, bool]], force: Vec3 = ZERO
) -> list[DeviceSample]:
    """Samples on a way of points, with the clutch held or not."""
    samples: list[DeviceSample] = []
    for k, (arm.position, held) in enumerate(way):
        arm.buttons = CLUTCH if held else 0
        samples.append(placed.read(PERIOD * k))
        placed.write(force)
    return samples


@given(motion, st.floats(0.2, 5.0))
def test_the_tip_moves_as_the_hand_does_and_stands_while_the_clutch_is_held(
    way: list[tuple[Vec3, bool]], size: float
) -> None:
    arm = Arm()
    placed = Placed(arm, Workspace(ZERO, (0.1, 0.2, 0.3), size), clutch=CLUTCH)
    samples = played(placed, arm, way)
    for k in range(1, len(way)):
        moved = sub(samples[k].position, samples[k - 1].position)
        # It is taken hold of where the hand is then.
        expected = ZERO if way[k - 1][1] else scale(sub(way[k][0], way[k - 1][0]), size)
        assert moved == pytest.approx(expected, abs=TIGHT)
        if way[k][1]:
            assert samples[k].velocity == ZERO


@given(motion)
def test_under_the_clutch_and_just_after_it_a_hand_gets_no_energy(
    way: list[tuple[Vec3, bool]],
) -> None:
    arm = Arm()
    placed = Placed(arm, Workspace(ZERO, ZERO), clutch=CLUTCH)
    for k, (arm.position, held) in enumerate(way):
        arm.buttons = CLUTCH if held else 0
        before = arm.force
        tip = placed.read(PERIOD * k)
        placed.write(PUSH)
        if tip.velocity == ZERO:
            assert arm.force == ZERO
        # Never by a jump either: what is given returns within `RETURN_TIME`.
        if before != PUSH and k > 0:
            limit = norm(PUSH) * PERIOD / RETURN_TIME
            assert norm(sub(arm.force, before)) <= limit + TIGHT


def test_the_clutch_waits_until_the_hand_feels_nothing() -> None:
    arm = Arm()
    placed = Placed(arm, Workspace(ZERO, ZERO), clutch=CLUTCH)
    played(placed, arm, [((0.0, 0.0, 0.0), False)], PUSH)
    moving = played(placed, arm, [((0.1, 0.0, 0.0), True)], PUSH)
    assert moving[0].position == (0.1, 0.0, 0.0)
    assert arm.force == PUSH
    played(placed, arm, [((0.1, 0.0, 0.0), True)], ZERO)
    held = played(placed, arm, [((0.2, 0.0, 0.0), True), ((0.3, 0.0, 0.0), True)])
    assert held[0].position == held[1].position


def forces(placed: Placed, arm: Arm, times: Iterable[float]) -> list[float]:
    """Sizes of the force on the hand at some times, while the loop asks for `PUSH`."""
    sizes: list[float] = []
    for now in times:
        placed.read(now)
        placed.write(PUSH)
        sizes.append(norm(arm.force))
    return sizes


def test_a_silent_device_gets_no_force_and_it_returns_slowly() -> None:
    arm = Arm()
    placed = Placed(arm, Workspace(ZERO, ZERO))
    assert forces(placed, arm, [0.0]) == [norm(PUSH)]
    arm.fresh = False
    gone = [norm(PUSH), *forces(placed, arm, (PERIOD * k for k in range(1, 30)))]
    assert gone[-1] == 0.0
    # Without a jerk, as after a fault.
    assert all(a - b <= norm(PUSH) * PERIOD / LOSS_TIME + TIGHT for a, b in pairwise(gone))
    arm.fresh = True
    steps = round(RETURN_TIME / PERIOD) + 2
    back = forces(placed, arm, (PERIOD * (30 + k) for k in range(steps)))
    limit = norm(PUSH) * PERIOD / RETURN_TIME
    assert all(0.0 <= b - a <= limit + TIGHT for a, b in pairwise([0.0, *back]))
    assert arm.force == pytest.approx(PUSH)


@pytest.mark.parametrize("period", [0.0195, 0.021, 0.2])
def test_after_a_stall_of_the_loop_the_force_comes_back_slowly(period: float) -> None:
    """The driver has taken it away meanwhile: the loop's next force would come in one step."""
    arm = Arm()
    arm.info = replace(INFO, lets_go=0.02)
    placed = Placed(arm, Workspace(ZERO, ZERO))
    assert forces(placed, arm, [5.0, 5.001])[-1] == norm(PUSH)  # the first reading is no stall
    assert forces(placed, arm, [5.001 + period]) == [0.0]
    # The loop's own ramp from before, 20 ms long, has nobody any more to be let go.
    waits = round(2.0 * LOSS_TIME / PERIOD) + 1
    later = forces(placed, arm, (5.001 + period + PERIOD * (k + 1) for k in range(waits + 1)))
    assert set(later[: waits - 2]) == {0.0}
    steps = [b - a for a, b in pairwise(later) if b > 0.0]
    assert steps == pytest.approx([norm(PUSH) * PERIOD / RETURN_TIME] * len(steps))
    assert later[-1] > 0.0


@pytest.mark.parametrize(("lets_go", "period"), [(math.inf, 0.2), (0.1, 0.05), (0.02, 0.01)])
def test_a_force_that_nothing_took_away_is_left_to_the_safety_layer(
    lets_go: float, period: float
) -> None:
    """To take it away here would be the very step that the layer's ramp avoids."""
    arm = Arm()
    arm.info = replace(INFO, lets_go=lets_go)
    placed = Placed(arm, Workspace(ZERO, ZERO))
    assert forces(placed, arm, [0.0, period]) == [norm(PUSH)] * 2


def test_a_late_period_takes_no_force_away_in_one_step() -> None:
    arm = Arm()
    placed = Placed(arm, Workspace(ZERO, ZERO))
    forces(placed, arm, [0.0])
    arm.fresh = False
    assert forces(placed, arm, [0.05]) >= [0.9 * norm(PUSH)]


@given(st.floats(0.1, 40.0))
def test_the_force_of_no_device_comes_back_faster_than_20_newtons_a_second(limit: float) -> None:
    assert limit / return_time(limit) <= 20.0 + TIGHT
    assert return_time(limit) >= RETURN_TIME


def config(options: str = "") -> DeviceConfig:
    pairs = tuple(tuple(item.split("=")) for item in options.split(",") if item)
    choice = DeviceChoice("arm", tuple((key, value) for key, value in pairs))
    return DeviceConfig(choice, (1.0, 2.0, 3.0), 0.5, CONFIG.device.hand, None)


@pytest.mark.parametrize(
    ("options", "middle"),
    [
        ("", (1.0, 2.0 - 0.55, 3.0)),
        ("place=top", (1.0, 2.0, 3.55)),
        ("place=center", (1.0, 2.0, 3.0)),
    ],
)
def test_its_middle_is_put_where_the_options_say(options: str, middle: Vec3) -> None:
    arm = Arm()
    arm.position = (0.0, 0.1, 0.2)
    placed = place(arm, config(options), middle=(0.0, 0.1, 0.2))
    assert placed.read(0.0).position == pytest.approx(middle)


@pytest.mark.parametrize(
    "options",
    ["scale=0", "scale=6", "scale=x", "turn=1000", "place=left", "recentre=1", "clutch=17"],
)
def test_an_option_outside_its_limits_is_named(options: str) -> None:
    with pytest.raises(SettingError, match="arm:" + options.partition("=")[0]):
        placed_info(config(options).choice, INFO)
    assert options.partition("=")[0] in dict(PLACING_OPTIONS)
