from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise

import pytest

from cohaptic.errors import DeviceError
from cohaptic.testing.manual_clock import ManualClock
from cohaptic.vec import ZERO, Vec3, norm
from cohaptic_client.loop.running.entry import ZEROS, Release
from cohaptic_client.loop.running.watchdog import Watchdog
from cohaptic_client.loop.safety import FAULT_RELEASE_TIME
from tests.client.loop.running.rigs import Rig

FORCE: Vec3 = (0.0, -6.0, 8.0)
PERIOD = 0.001  # s


class Slow(Rig):
    """A device whose writes take their time, and may fail."""

    def __init__(self, clock: ManualClock, each: Callable[[int], float]) -> None:
        super().__init__()
        self.clock, self.takes, self.writes = clock, each, 0

    def write(self, force: Vec3) -> None:
        super().write(force)
        self.writes += 1
        self.clock.sleep_until(self.clock.now() + self.takes(self.writes))


def released(each: Callable[[int], float], force: Vec3 = FORCE) -> tuple[Slow, float]:
    clock = ManualClock()
    rig, start = Slow(clock, each), clock.now()
    release = Release(rig, clock, PERIOD)
    release(force)
    release(force)
    return rig, clock.now() - start


def test_a_force_goes_along_the_ramp_and_zero_is_written_twice_and_the_device_closed_once() -> None:
    rig, took = released(lambda _: 0.0)
    assert rig.log[-1 - ZEROS :] == [ZERO] * ZEROS + ["close"]
    sizes = [norm(FORCE), *map(norm, rig.forces)]
    steepest = 1.5 * norm(FORCE) / FAULT_RELEASE_TIME * PERIOD
    assert all(-1e-9 <= a - b <= steepest for a, b in pairwise(sizes))
    assert took == pytest.approx(FAULT_RELEASE_TIME)


@pytest.mark.parametrize("takes", [0.002, 0.004, 0.008, 0.05])
def test_a_slow_device_is_at_zero_no_later_than_a_fast_one(takes: float) -> None:
    """But for the write that is under way."""
    rig, took = released(lambda _: takes)
    assert rig.log[-1 - ZEROS :] == [ZERO] * ZEROS + ["close"]
    assert took <= FAULT_RELEASE_TIME + (1 + ZEROS) * takes + PERIOD
    # Each force is the one of its time on the ramp.
    sizes = [norm(force) for force in rig.forces[:-ZEROS]]
    assert sizes == sorted(sizes, reverse=True)


class Watched(Slow):
    """A slow device that another thread may release, which looks while each write is under way."""

    def __init__(self, clock: ManualClock, each: Callable[[int], float]) -> None:
        super().__init__(clock, each)
        self.dog = Watchdog(self, clock, 0.02, lambda _: None)

    def write(self, force: Vec3) -> None:
        super().write(force)
        self.dog.look()

    def release(self) -> None:
        self.log.append("release")


def test_a_write_that_hangs_in_the_ramp_is_the_last_with_a_force() -> None:
    clock = ManualClock()
    rig = Watched(clock, lambda writes: 0.03 if writes == 4 else 0.0)
    Release(rig, clock, PERIOD, rig.dog)(FORCE)
    at = rig.log.index("release")
    assert sum(force != ZERO for force in rig.forces) == 4
    assert rig.log[at + 1 :] == [ZERO] * ZEROS + ["close"]
    assert rig.dog.since == math.inf


def test_what_the_watchdog_has_taken_away_is_not_given_again() -> None:
    clock = ManualClock()
    rig = Watched(clock, lambda _: 0.0)
    rig.dog.fired = True
    Release(rig, clock, PERIOD, rig.dog)(FORCE)
    assert rig.log == [ZERO] * ZEROS + ["close"]


@pytest.mark.parametrize("fails", [1, 7])
def test_a_device_that_refuses_a_write_gets_its_zeros_at_once(fails: int) -> None:
    def each(writes: int) -> float:
        if writes >= fails:
            raise DeviceError("rig", "gone")
        return 0.0

    rig, _ = released(each)
    assert len(rig.forces) == fails + ZEROS
    assert rig.log[-1 - ZEROS :] == [ZERO] * ZEROS + ["close"]
