from __future__ import annotations

import time  # noqa: TID251  # the wall clock, for comparison

from cohaptic.clock import Clock, SystemClock
from cohaptic.testing import ManualClock


def test_a_system_clock_runs_forward_and_waits() -> None:
    clock = SystemClock()
    start = clock.now()
    clock.sleep_until(start + 0.002)
    assert clock.now() >= start + 0.002
    clock.sleep_until(start)  # in the past: no wait


def test_clocks_of_two_processes_are_hours_apart() -> None:
    readings = {round(SystemClock().now() / 60.0) for _ in range(10)}
    assert len(readings) > 5


def test_a_shared_origin_gives_the_same_time() -> None:
    one = SystemClock()
    two = SystemClock(one.origin)
    assert abs(one.now() - two.now()) < 1.0


def test_to_wall_leads_to_unix_time() -> None:
    clock = SystemClock()
    assert abs(clock.now() + clock.to_wall() - time.time()) < 1.0


def test_a_manual_clock_jumps_and_never_runs_backwards() -> None:
    clock: Clock = ManualClock(5.0)
    clock.sleep_until(3605.0)
    assert clock.now() == 3605.0
    clock.sleep_until(1.0)
    assert clock.now() == 3605.0
