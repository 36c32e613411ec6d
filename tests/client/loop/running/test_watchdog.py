"""A device whose calls do not return, in virtual time, and in real time with a real thread."""

from __future__ import annotations

import math
import threading
from dataclasses import replace

import pytest

from cohaptic.runtime.scheduling import LOOP_PRIORITY
from cohaptic.status.row import rows_in
from cohaptic.testing.manual_clock import ManualClock
from cohaptic.vec import ZERO, Vec3, norm
from cohaptic_client.devices.device import DeviceSample
from cohaptic_client.loop.memory import LoopMemory
from cohaptic_client.loop.running import watchdog
from cohaptic_client.loop.running.haptic_loop import HapticLoop
from cohaptic_client.loop.running.watchdog import GIVE_UP, HELD, Releasable, Watchdog
from tests.client.loop.running.rigs import CLOCK, FORCE, LIMITS, Parent, Rig

pytestmark = pytest.mark.alone

LIMIT = 0.02  # s
HANGS = 0.5  # s in real time: a machine that stands still for less is no device that hangs


class Released(Rig):
    """A rig that can be let go by another thread."""

    releases = 0

    def release(self) -> None:
        self.releases += 1


def test_only_a_device_that_can_be_released_is_watched() -> None:
    assert isinstance(Released(), Releasable)
    assert not isinstance(Rig(), Releasable)


def test_a_call_that_hangs_is_released_once_and_in_the_end_the_process_ends() -> None:
    clock, rig, ends = ManualClock(), Released(), list[int]()
    dog = Watchdog(rig, clock, LIMIT, ends.append)
    dog.since = clock.now()
    for _ in range(4):
        clock.sleep_until(clock.now() + 0.25 * LIMIT)
        dog.look()
    assert (rig.releases, dog.fired) == (0, False)
    clock.sleep_until(clock.now() + 0.5 * LIMIT)
    dog.look()
    dog.look()
    assert (rig.releases, dog.fired, ends) == (1, True, [])
    clock.sleep_until(clock.now() + GIVE_UP)
    dog.look()
    assert ends == [HELD]


class NeverReleased(Released):
    """The release of a driver waits for the same transfer as the loop."""

    def __init__(self) -> None:
        super().__init__()
        self.over, self.returned = threading.Event(), False

    def release(self) -> None:
        self.over.wait(5.0)
        self.returned = True


def test_a_release_that_hangs_too_does_not_keep_the_process_from_ending() -> None:
    clock, rig, ends = ManualClock(), NeverReleased(), list[int]()
    dog = Watchdog(rig, clock, LIMIT, ends.append)
    dog.since = clock.now()
    for hung in (2.0 * LIMIT, 2.0 * GIVE_UP):
        clock.sleep_until(clock.now() + hung)
        dog.look()
    assert (ends, rig.returned) == ([HELD], False)
    rig.over.set()


def test_between_two_periods_nothing_is_released_however_long() -> None:
    clock, rig = ManualClock(), Released()
    dog = Watchdog(rig, clock, LIMIT, lambda status: pytest.fail(str(status)))
    assert dog.since == math.inf
    clock.sleep_until(clock.now() + 3600.0)
    dog.look()
    assert rig.releases == 0


class Hanging(Released):
    """One read or write does not return before another thread has released the device."""

    def __init__(self, parent: Parent, call: str) -> None:
        super().__init__(parent.stop_after(200))
        self.call = call
        self.let_go = threading.Event()

    def read(self, now: float) -> DeviceSample:
        sample = super().read(now)
        self.hang("read")
        return sample

    def write(self, force: Vec3) -> None:
        self.hang("write")
        super().write(force)  # what it was called with comes after the release

    def hang(self, call: str) -> None:
        if call == self.call and self.reads == 100:
            assert self.let_go.wait(30.0)

    def release(self) -> None:
        super().release()
        self.log.append("release")
        self.let_go.set()


@pytest.mark.smoke
@pytest.mark.parametrize("latch", [False, True])
@pytest.mark.parametrize("call", ["read", "write"])
def test_a_call_that_hangs_is_released_and_the_loop_goes_on_from_no_force(
    parent: Parent, call: str, latch: bool
) -> None:
    parent.config = replace(parent.config, limits=replace(LIMITS, latch=latch))
    rig = Hanging(parent, call)
    memory = LoopMemory(parent.memory.path)
    dog = Watchdog(rig, CLOCK, HANGS, lambda status: pytest.fail(str(status)))
    dog.start()
    try:
        HapticLoop(parent.config, memory, rig, "as it was", dog).run()
    finally:
        dog.stop()
        memory.close(remove=False)
    at = rig.log.index("release")
    assert norm([f for f in rig.log[:at] if not isinstance(f, str)][-1]) == pytest.approx(FORCE)
    after = [f for f in rig.log[at + 1 :] if not isinstance(f, str)]
    if call == "write":  # it went on where it hung, and zero came after it, in the same period
        assert norm(after.pop(0)) == pytest.approx(FORCE)
        assert rig.log[at + 2] == ZERO
    # The tip is inside: no force until it was out.
    assert len(after) > 50
    assert set(after) == {ZERO}
    status = parent.status()
    assert status["mode"] == ("fault" if latch else "waiting")
    assert "the device held up the loop for more than" in str(status["fault"])
    # And the body got none either.
    rows = [row for row in rows_in(parent.memory.rows.read_new()) if row.t > 0.0]
    assert {(row.fx, row.fy, row.fz) for row in rows[100:]} == {ZERO}
    assert rows[99].damping == 0.0  # nor is a part of a force told that was not given


def test_it_goes_before_the_loop_which_may_spin_at_a_real_time_priority(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked, reported = list[tuple[int, str]](), threading.Event()

    def prefer(priority: int) -> str:
        asked.append((priority, threading.current_thread().name))
        reported.set()
        return "as it was"

    monkeypatch.setattr(watchdog, "prefer_this_process", prefer)
    dog = Watchdog(Released(), CLOCK, LIMIT, lambda status: pytest.fail(str(status)))
    dog.start()
    assert reported.wait(30.0)
    dog.stop()
    assert asked == [(LOOP_PRIORITY + 1, "watchdog")]
