"""The life of the loop's process, in the tests' own."""

from __future__ import annotations

import gc
import signal
import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise

import pytest

from cohaptic.clock import Clock
from cohaptic.errors import CohapticError, DeviceError
from cohaptic.vec import ZERO, Vec3, norm
from cohaptic_client.devices.device import Device, DeviceSample
from cohaptic_client.devices.kind import DeviceChoice, DeviceConfig
from cohaptic_client.loop.memory import LoopMemory, Slot
from cohaptic_client.loop.running import entry
from cohaptic_client.loop.running.entry import (
    _ENDING,  # pyright: ignore[reportPrivateUsage]
    _IGNORED,  # pyright: ignore[reportPrivateUsage]
)
from cohaptic_client.loop.running.watchdog import Releasable, Watchdog
from cohaptic_client.loop.safety import FAULT_RELEASE_TIME
from tests.client.loop.running.rigs import CLOCK, FORCE, Parent, Rig

pytestmark = [pytest.mark.alone, pytest.mark.usefixtures("terminal")]

HANDLED = [getattr(signal, name) for name in (*_IGNORED, *_ENDING) if hasattr(signal, name)]
Main = Callable[[Device | CohapticError], None]


@pytest.fixture
def main(parent: Parent, monkeypatch: pytest.MonkeyPatch) -> Iterator[Main]:
    """The entry point of the process, here, without its lasting changes to the process."""

    def run(device: Device | CohapticError) -> None:
        def opened(config: DeviceConfig) -> Device:
            assert config == parent.config.device
            if isinstance(device, CohapticError):
                raise device
            return device

        monkeypatch.setattr(entry, "open_device", opened)

        def as_it_was(_priority: int) -> str:
            return "as it was"

        monkeypatch.setattr(entry, "prefer_this_process", as_it_was)
        monkeypatch.setattr(entry, "lock_memory", lambda: "memory not locked")
        entry.live(parent.config.to_json())

    caught = [n for n in signal.valid_signals() if callable(signal.getsignal(n))]
    before = {n: signal.getsignal(n) for n in {*caught, *map(int, HANDLED)}}
    yield run
    for number, handler in before.items():
        signal.signal(number, handler)
    gc.unfreeze()
    gc.enable()


def fail_after(reads: int, error: Exception) -> Callable[[int], None]:
    def each(count: int) -> None:
        if count == reads:
            raise error

    return each


class Watched(Rig):
    """A rig that notes at each write whether trouble was reported already."""

    def __init__(self, each: Callable[[int], None], status: Slot) -> None:
        super().__init__(each)
        self.status = status
        self.reported = list[bool]()

    def write(self, force: Vec3) -> None:
        super().write(force)
        self.reported.append(b'"error"' in (self.status.read() or b""))


class Timed(Rig):
    """A rig that notes the time of each write."""

    def __init__(self, each: Callable[[int], None]) -> None:
        super().__init__(each)
        self.times = list[float]()

    def write(self, force: Vec3) -> None:
        super().write(force)
        self.times.append(CLOCK.now())


class Broken(Rig):
    """A device whose driver raises at every write once it broke."""

    def __init__(self, error: Exception) -> None:
        super().__init__()
        self.error = error

    def write(self, force: Vec3) -> None:
        super().write(force)
        if self.reads >= 50:
            raise self.error


class HangsThenFails(Rig):
    """A read does not return before another thread has released the device, and then fails."""

    def __init__(self) -> None:
        super().__init__()
        self.let_go = threading.Event()

    def read(self, now: float) -> DeviceSample:
        sample = super().read(now)
        if self.reads == 100:
            assert self.let_go.wait(30.0)
            raise DeviceError("rig", "gone")
        return sample

    def release(self) -> None:
        self.log.append("release")
        self.let_go.set()


def after_the_last_read(rig: Rig) -> list[Vec3 | str]:
    return rig.log[len(rig.log) - rig.log[::-1].index("read") :]


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (DeviceError("rig", "it was unplugged", "plug it in again"), "rig: it was unplugged; plug"),
        (ValueError("boom"), "the haptic loop failed: ValueError('boom')"),
    ],
    ids=["foreseen", "unforeseen"],
)
def test_trouble_in_the_device_means_a_release_zero_force_twice_then_close_then_the_report(
    parent: Parent, main: Main, error: Exception, words: str
) -> None:
    watching = LoopMemory(parent.memory.path)
    rig = Watched(fail_after(100, error), watching.status)
    with pytest.raises((SystemExit, ValueError)):
        main(rig)
    assert norm(rig.forces[98]) == pytest.approx(FORCE)  # in the period before the trouble
    end = after_the_last_read(rig)
    assert end[-3:] == [ZERO, ZERO, "close"]
    # It is let go as after a fault, not dropped.
    ramp = [FORCE, *(norm(force) for force in end[:-1] if not isinstance(force, str))]
    assert ramp == sorted(ramp, reverse=True)
    assert len(ramp) > 4
    assert not any(rig.reported)
    assert str(parent.status()["error"]).startswith(words)
    watching.close(remove=False)


@pytest.mark.parametrize(
    "error", [DeviceError("rig", "gone"), OSError("gone"), RuntimeError("gone")]
)
def test_a_device_that_refuses_every_write_is_told_zero_twice_closed_and_reported(
    parent: Parent, main: Main, error: Exception
) -> None:
    rig = Broken(error)
    with pytest.raises((SystemExit, type(error))):
        main(rig)
    assert after_the_last_read(rig)[-3:] == [ZERO, ZERO, "close"]
    assert len(after_the_last_read(rig)) == 1 + 1 + 3  # the write that failed, and no ramp after it
    assert "gone" in str(parent.status()["error"])


def test_a_force_that_the_watchdog_has_taken_away_does_not_come_again_at_the_end(
    parent: Parent, main: Main, monkeypatch: pytest.MonkeyPatch
) -> None:
    def quick(device: Releasable, clock: Clock, _limit: float) -> Watchdog:
        return Watchdog(device, clock, 0.02)

    monkeypatch.setattr(entry, "Watchdog", quick)
    rig = HangsThenFails()
    with pytest.raises(SystemExit):
        main(rig)
    assert rig.log[rig.log.index("release") :] == ["release", ZERO, ZERO, "close"]


def test_a_device_that_cannot_be_had_ends_the_process_with_its_sentence(
    parent: Parent, main: Main
) -> None:
    with pytest.raises(SystemExit) as ended:
        main(DeviceError("spacemouse", "no SpaceMouse was found", "plug one in"))
    assert ended.value.code == 2
    assert parent.status() == {"error": "spacemouse: no SpaceMouse was found; plug one in"}


def test_a_clutch_on_the_switch_of_the_board_that_was_found_is_refused(
    parent: Parent, main: Main
) -> None:
    device = replace(parent.config.device, choice=DeviceChoice("rig", (("clutch", "1"),)))
    limits = replace(parent.config.limits, dead_man=True)
    parent.config = replace(parent.config, device=device, limits=limits)
    rig = Rig()
    rig.info = replace(Rig.info, switch=True)
    with pytest.raises(SystemExit):
        main(rig)
    assert rig.log == ["close"]
    assert "its clutch is the switch that the hand holds" in str(parent.status()["error"])


def test_told_to_stop_the_process_ends_without_a_word_and_lets_go(
    parent: Parent, main: Main
) -> None:
    rig = Rig(parent.stop_after(50))
    main(rig)
    assert rig.log[-3:] == [ZERO, ZERO, "close"]
    assert "error" not in parent.status()


@pytest.mark.smoke
@pytest.mark.parametrize("number", HANDLED, ids=lambda number: signal.Signals(number).name)
def test_no_signal_ends_the_loop_with_force_on_the_hand(
    parent: Parent, main: Main, number: int
) -> None:
    """Those that would stop or end it at once do neither."""

    def each(reads: int) -> None:
        if reads == 100:
            signal.raise_signal(number)
        if reads == 150:
            parent.command(stop=True)

    rig = Timed(each)
    if signal.Signals(number).name in _IGNORED:
        main(rig)
        assert rig.reads > 150
    else:
        with pytest.raises(SystemExit):
            main(rig)
        assert rig.reads == 100
        assert signal.Signals(number).name in str(parent.status()["error"])
    assert rig.log[-3:] == [ZERO, ZERO, "close"]
    sizes = [norm(force) for force in rig.forces[98:]]
    # A machine that is busy is no failure: each force is the one of its time on the ramp.
    steepest, period = 1.5 * FORCE / FAULT_RELEASE_TIME, parent.config.haptic_period
    times = pairwise(rig.times[98:])
    largest = [steepest * (max(later - now, period) + 2.0 * period) for now, later in times]
    assert all(a - b <= m + 1e-9 for (a, b), m in zip(pairwise(sizes), largest, strict=True))


def test_ctrl_c_does_not_reach_the_loop(parent: Parent, main: Main) -> None:
    reached = list[int]()
    signal.signal(signal.SIGINT, lambda number, _: reached.append(number))

    def each(reads: int) -> None:
        if reads == 20:
            signal.raise_signal(signal.SIGINT)
        if reads == 50:
            parent.command(stop=True)

    rig = Rig(each)
    main(rig)
    assert rig.reads > 50
    assert reached == []


@pytest.mark.skipif(not hasattr(signal, "SIGHUP"), reason="Windows has no SIGHUP")
def test_under_nohup_a_terminal_that_closes_ends_nothing(parent: Parent, main: Main) -> None:
    signal.signal(signal.SIGHUP, signal.SIG_IGN)

    def each(reads: int) -> None:
        if reads == 20:
            signal.raise_signal(signal.SIGHUP)
        if reads == 50:
            parent.command(stop=True)

    rig = Rig(each)
    main(rig)
    assert rig.reads > 50
    assert "error" not in parent.status()
