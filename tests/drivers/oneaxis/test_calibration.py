"""The calibration on the real firmware, with a hand that does what it is asked to."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.errors import DeviceError
from cohaptic_client.devices.catalogue import read_device
from cohaptic_drivers.oneaxis.calibration import (
    NUDGE,
    WAY,
    _await_rest,  # pyright: ignore[reportPrivateUsage]
    _way_of_motor,  # pyright: ignore[reportPrivateUsage]
)
from cohaptic_drivers.oneaxis.frames import Report
from cohaptic_drivers.oneaxis.oneaxis_kind import calibrate_oneaxis
from tests.client.devices.until import SteadyClock, until

if sys.platform == "win32":
    pytest.skip("there are no pseudo-terminals", allow_module_level=True)

from tests.drivers.oneaxis.board import Board

# A hand that moves in a thread of this process, while the driver waits for it to be at rest.
pytestmark = pytest.mark.alone

CLOCK = SteadyClock()  # a process that stands still is no handle that does


@pytest.fixture
def board() -> Iterator[Board]:
    made = Board()
    yield made
    made.unplug()


def asked(board: Board, way: float, after: float = 0.0) -> list[str]:
    """The lines, with a hand that moves the handle by `way` [m] when it is asked to.

    In the end it is on its way to `after` [m] while the motor nudges.
    """
    said: list[str] = []

    def ask(what: str) -> None:
        said.append(what)
        goal = way if what.startswith("Move it") else 0.0
        board.rig.goal(goal)
        until(lambda: abs(board.rig.place - goal) < 1e-5)
        if what.startswith("Put") and after:
            board.rig.goal(after)

    lines = calibrate_oneaxis(read_device(f"oneaxis:port={board.path}"), CLOCK, ask)
    assert [each.split(" ")[0] for each in said] == ["Hold", "Move", "Put"]
    return lines


@pytest.mark.parametrize("turned", [False, True])
def test_it_finds_counts_and_directions(board: Board, turned: bool) -> None:
    if turned:
        board.rig.turned()
    lines = asked(board, WAY)
    assert lines[0].startswith("counts_per_metre = ")
    assert float(lines[0].split(" = ")[1]) == pytest.approx(80_000, rel=0.01)
    assert lines[1] == f"sensor_direction = {-1 if turned else 1}"
    assert board.rig.limit <= NUDGE * 0.5 + 1e-3
    until(lambda: board.current == 0.0)
    # The hand of this rig holds its handle: 0.125 A are 0.75 N and 1.9 mm, too little to be sure.
    assert lines[2].startswith("# The handle did not move")


def test_a_hand_that_lets_go_sees_the_direction_of_the_motor(
    board: Board, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("cohaptic_drivers.oneaxis.calibration._ENOUGH", 0.0005)
    assert "motor_direction = 1" in asked(board, WAY)


@pytest.mark.parametrize("turned", [False, True])
def test_a_hand_that_still_moves_at_the_nudge_is_not_taken_for_the_motor(
    board: Board, monkeypatch: pytest.MonkeyPatch, turned: bool
) -> None:
    """A wrong direction would make of an object that pushes back one that pulls in."""
    monkeypatch.setattr("cohaptic_drivers.oneaxis.calibration._ENOUGH", 0.0005)
    if turned:
        board.rig.turned()
    assert f"motor_direction = {-1 if turned else 1}" in asked(board, WAY, after=0.05)


def test_a_handle_that_does_not_come_to_rest_is_told(
    board: Board, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("cohaptic_drivers.oneaxis.calibration._LONGEST_REST", 0.5)
    with pytest.raises(DeviceError, match="does not come to rest; let go of it"):
        asked(board, WAY, after=100.0)
    assert board.rig.limit == 0.0


class Falling:
    """A link to a handle that falls one way as soon as it is touched, whatever its motor does."""

    def __init__(self) -> None:
        self.time = self.amperes = 0.0
        self.counts = 0

    def now(self) -> float:
        return self.time

    def sleep_until(self, when: float) -> None:
        self.time = when

    def send(self, amperes: float) -> None:
        self.amperes = amperes

    def poll(self) -> Report:
        self.time += 0.001
        self.counts += 5 if self.amperes != 0.0 else 0
        return Report(0, self.time, self.counts, self.amperes)


def test_a_handle_that_moves_the_same_way_with_either_current_is_told() -> None:
    handle: Any = Falling()
    with pytest.raises(DeviceError, match="the same way with either current; let go of it"):
        _way_of_motor(handle, handle, 0.1, 240.0)
    assert handle.amperes == 0.0


class Swinging(Falling):
    """One that swings for a second, read by a process that stands still after its first look.

    Args:
        counts: Of its swing to either side.
        stall: For how long that process stands still [s].
    """

    def __init__(self, counts: float, stall: float) -> None:
        super().__init__()
        self._limit, self._stall, self._looks = counts, stall, 0

    def poll(self) -> Report:
        self._looks += 1
        # Each look polls twice: what is old is thrown away first.
        self.time += self._stall if self._looks == 3 else 0.001
        left = max(0.0, 1.0 - self.time)
        self.counts = round(self._limit * left * math.cos(2.0 * math.pi * self.time / 0.25))
        return Report(0, self.time, self.counts, self.amperes)


@given(counts=st.floats(100.0, 1000.0), stall=st.floats(0.001, 0.6))
def test_a_process_that_stood_still_takes_no_moving_handle_for_one_at_rest(
    counts: float, stall: float
) -> None:
    handle: Any = Swinging(counts, stall)
    _await_rest(handle, handle, 10.0)
    # It swings by no more than `still` from now on.
    assert counts * max(0.0, 1.0 - handle.time) <= 20.0
