from __future__ import annotations

from cohaptic.clock import Clock, SystemClock
from cohaptic.testing import ManualClock


def test_a_shared_origin_gives_the_same_time() -> None:
    one = SystemClock()
    two = SystemClock(one.origin)
    assert abs(one.now() - two.now()) < 1.0


def test_a_manual_clock_jumps_and_never_runs_backwards() -> None:
    clock: Clock = ManualClock(5.0)
    clock.sleep_until(3605.0)
    assert clock.now() == 3605.0
    clock.sleep_until(1.0)
    assert clock.now() == 3605.0
