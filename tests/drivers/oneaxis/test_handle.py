"""A handle on a scripted link, in virtual time."""

from __future__ import annotations

import math
import sys
from dataclasses import replace

import pytest

from cohaptic.errors import DeviceError
from cohaptic.vec import ZERO
from cohaptic_client.devices.pulse import pulse, verdict
from cohaptic_client.loop.arrival import receive
from cohaptic_client.loop.safety import SafetyLimits
from cohaptic_client.loop.state import LoopSettings, LoopState
from cohaptic_client.loop.step import step
from cohaptic_drivers.oneaxis.frames import Description, Report
from cohaptic_drivers.oneaxis.handle import GIVE_UP, SILENCE, Handle
from cohaptic_drivers.oneaxis.unit import Unit
from tests.client.plane import PLANE

pytestmark = pytest.mark.live

BOARD = Description(1, 0.5, 1.0, 0.05, 0.5, 2000)
UNIT = Unit(counts_per_metre=100_000.0, torque_constant=0.02, gear=20.0, handle_radius=0.08)
FIRST = Report(0, 100.0, 400, 0.0)
LAST = 2.0**32 * 1e-6  # s; where the board's clock runs over


class Link:
    def __init__(self) -> None:
        self.reported: Report | None = None
        self.given: list[float] = []
        self.ends = 0

    def poll(self) -> Report | None:
        reported, self.reported = self.reported, None
        return reported

    def send(self, amperes: float) -> None:
        self.given.append(amperes)

    def release(self) -> None:
        self.send(0.0)

    def close(self) -> None:
        self.ends += 1


class Scene:
    """A handle that was read once, at 5 s, when its board's clock was at 100 s."""

    def __init__(self, unit: Unit = UNIT, time: float = 100.0) -> None:
        self.link = Link()
        first = replace(FIRST, time=time)
        self.handle = Handle(unit, self.link, BOARD, first, axis=(0.0, 1.0, 0.0))
        self.time, self.now = time, 5.0
        for _ in range(3):
            self.after(0.001, 400)

    def after(self, passed: float, counts: int | None, *, board: float | None = None) -> float:
        """Read after `passed` [s], with a report or without; where the tip is [m]."""
        self.now += passed
        self.time = (self.time + (passed if board is None else board)) % LAST
        if counts is not None:
            self.link.reported = replace(FIRST, time=self.time, counts=counts)
        return self.handle.read(self.now).position[1]


@pytest.mark.parametrize("time", [100.0, LAST - 0.05])
def test_its_velocity_goes_by_the_boards_clock_that_runs_over(time: float) -> None:
    scene = Scene(time=time)
    for k in range(200):
        # What a busy machine adds to a period is no motion: 0.1 m/s all the while.
        scene.after(0.0005 if k % 2 else 0.0015, 400 + 10 * k, board=0.001)
    sample = scene.handle.read(scene.now)
    assert sample.velocity[1] == pytest.approx(0.1, rel=1e-3)
    assert (sample.velocity[0], sample.velocity[2]) == (0.0, 0.0)


def test_a_sensor_that_jumps_is_a_fault() -> None:
    scene = Scene()
    scene.after(0.001, 1300)  # 9 mm
    with pytest.raises(DeviceError, match="its sensor jumped"):
        scene.after(0.001, 2500)


def test_a_handle_that_goes_on_for_ever_is_a_fault() -> None:
    """A counter that creeps away is no handle: it has a travel."""
    scene = Scene()
    for k in range(1, 32):
        scene.after(0.01, 400 + 500 * k)
    with pytest.raises(DeviceError, match="its sensor jumped"):
        scene.after(0.01, 400 + 500 * 33)


@pytest.mark.parametrize("board", [-100.0, 0.5, 4000.0])
def test_a_board_that_started_anew_lost_its_counts(board: float) -> None:
    scene = Scene()
    with pytest.raises(DeviceError, match="its board started anew"):
        scene.after(0.001, 400, board=board)


def test_a_process_that_stood_still_takes_neither_board_for_silent_nor_hand_for_a_jump() -> None:
    """What it finds first has waited for it; the hand has gone 60 mm meanwhile."""
    scene = Scene()
    scene.after(0.5, 400, board=0.001)
    assert scene.after(0.002, 6400, board=0.501) == pytest.approx(0.06)
    assert scene.handle.read(scene.now).fresh


def test_a_silence_is_told_and_then_the_end() -> None:
    scene = Scene()
    for k in range(1, round(1e3 * GIVE_UP)):
        scene.after(0.001, None)
        sample = scene.handle.read(scene.now)
        if abs(0.001 * k - SILENCE) > 1e-9:  # at the limit itself rounding decides
            assert sample.fresh == (0.001 * k < SILENCE)
        assert sample.fresh or sample.velocity == ZERO
    with pytest.raises(DeviceError, match="its board has been silent for 251 ms"):
        scene.after(0.002, None)


def test_a_force_is_a_current_by_gear_radius_and_constant() -> None:
    scene = Scene()
    scene.handle.write((7.0, -1.0, 7.0))
    assert scene.link.given[-1] == pytest.approx(-1.0 * 0.08 / 20.0 / 0.02)
    scene.handle.write((0.0, -1000.0, 0.0))
    assert scene.link.given[-1] == -UNIT.max_current
    for bad in (math.nan, math.inf):
        scene.handle.write((0.0, bad, 0.0))
        assert scene.link.given[-1] == 0.0


def test_what_it_gives_is_the_least_of_unit_and_board() -> None:
    assert Scene().handle.info.max_force == pytest.approx(2.5)
    assert Scene(replace(UNIT, max_force=2.0)).handle.info.max_force == 2.0
    assert Scene(replace(UNIT, torque_constant=0.0)).handle.info.force_axes == 0


@pytest.mark.skipif(sys.platform == "win32", reason="its library is made as on POSIX")
@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_a_knock_shows_whether_its_motor_pushes_where_the_file_says(direction: float) -> None:
    from tests.drivers.oneaxis.virtual_board import UNIT, VirtualBoard

    board = VirtualBoard()
    handle = board.handle(replace(UNIT, motor_direction=direction))
    ways = pulse(handle, board, (0.0, -1.0, 0.0))
    if direction > 0.0:
        assert "with each of its knocks" in verdict("oneaxis", ways)
    else:
        with pytest.raises(DeviceError, match="against each of its knocks"):
            verdict("oneaxis", ways)


@pytest.mark.skipif(sys.platform == "win32", reason="its library is made as on POSIX")
@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_a_motor_the_wrong_way_round_pulls_in_and_no_harder_than_the_limit(
    direction: float,
) -> None:
    """No loop can tell a motor that pulls from a hand that pushes: the limit is what is left."""
    from tests.drivers.oneaxis.virtual_board import PERIOD, UNIT, VirtualBoard

    board, limits = VirtualBoard(), SafetyLimits(max_force=1.0, engage_time=0.2)
    handle = board.handle(replace(UNIT, motor_direction=direction))
    settings, state = LoopSettings(1.0 / 60.0, limits, max_stiffness=300.0), LoopState()
    surface = replace(PLANE, x_free=(0.0, 0.002, 0.0), normal=(0.0, -1.0, 0.0))
    for n in range(2000):
        if n % 16 == 0:
            patch = replace(surface, tick=n // 16 + 1)
            state = receive(state, patch, board.now(), settings)
        if n == 500:
            board.rig.goal(0.006)
        state, output = step(state, handle.read(board.now()), board.now(), settings)
        handle.write(output.force)
        board.sleep_until(board.now() + PERIOD)
    # The hand's goal, less or more the force over its spring; 6 N for an ampere.
    yielded = board.rig.place - 0.006
    assert (yielded < -1e-3) == (direction > 0.0)
    assert (yielded > 1e-3) == (direction < 0.0)
    assert 6.0 * board.rig.limit <= limits.max_force + 0.01
    assert state.safety.fault == ""
