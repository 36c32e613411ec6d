from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import pytest

from cohaptic.errors import DeviceError
from cohaptic.testing.manual_clock import ManualClock
from cohaptic.vec import ZERO, Vec3, norm
from cohaptic_client.loop.running.letting_go import LONGEST_RELEASE, ZEROS, Release
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


def test_without_a_force_there_is_no_ramp() -> None:
    for force in (ZERO, (float("nan"), 0.0, 0.0)):
        rig, took = released(lambda _: 0.0, force)
        assert rig.log == [ZERO] * ZEROS + ["close"]
        assert took == 0.0


def test_a_slow_device_is_at_zero_within_the_stated_time() -> None:
    rig, took = released(lambda _: 0.008)
    assert rig.log[-1 - ZEROS :] == [ZERO] * ZEROS + ["close"]
    assert took <= LONGEST_RELEASE + (1 + ZEROS) * 0.008 + PERIOD


@pytest.mark.parametrize("fails", [1, 7])
def test_a_device_that_refuses_a_write_gets_its_zeros_at_once(fails: int) -> None:
    def each(writes: int) -> float:
        if writes >= fails:
            raise DeviceError("rig", "gone")
        return 0.0

    rig, _ = released(each)
    assert len(rig.forces) == fails + ZEROS
    assert rig.log[-1 - ZEROS :] == [ZERO] * ZEROS + ["close"]
