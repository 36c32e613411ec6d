"""The loop in the tests' own process, on a scripted device. Real time, but little."""

from __future__ import annotations

import gc
import json
import math
import signal
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from cohaptic.clock import SystemClock
from cohaptic.errors import CohapticError, DeviceError
from cohaptic.status.row import Row
from cohaptic.vec import ZERO, Vec3, norm
from cohaptic_client.devices.device import Device, DeviceInfo, DeviceSample
from cohaptic_client.devices.device_config import DeviceConfig
from cohaptic_client.loop import process as loop_process
from cohaptic_client.loop.memory import LoopMemory, Slot
from cohaptic_client.loop.process import COMMAND, SAMPLE, HapticLoop, status_json
from cohaptic_client.loop.safety import FAULT_RELEASE_TIME, SAFETY_FADE_RATE, SafetyLimits
from tests.client.plane import CONFIG, PLANE, STIFFNESS

CLOCK = SystemClock()
# One patch is enough for a test, and a hiccup of the machine is no fault.
LIMITS = SafetyLimits(silent_after=60.0, fade_time=0.03, engage_time=0.01, stall=60.0)
OUTSIDE: Vec3 = (0.0, 0.0, 0.01)
INSIDE: Vec3 = (0.0, 0.0, -0.004)
FORCE = 0.004 * STIFFNESS
QUIET = 20  # periods outside, at the start


class Rig:
    """A device that notes all calls, and asks a test for its sample in each period."""

    info = DeviceInfo("rig", max_force=10.0, max_stiffness=1000.0)

    def __init__(
        self, each: Callable[[int], None] = lambda _: None, *, pressed: Vec3 = INSIDE
    ) -> None:
        self.each = each
        self.pressed = pressed
        self.reads = 0
        self.log = list[Vec3 | str]()

    def read(self, now: float) -> DeviceSample:
        self.reads += 1
        self.log.append("read")
        self.each(self.reads)
        return DeviceSample(OUTSIDE if self.reads <= QUIET else self.pressed, ZERO)

    def write(self, force: Vec3) -> None:
        self.log.append(force)

    def close(self) -> None:
        self.log.append("close")

    @property
    def forces(self) -> list[Vec3]:
        return [entry for entry in self.log if not isinstance(entry, str)]


class Parent:
    """The network process's side of the memory."""

    def __init__(self) -> None:
        self.memory = LoopMemory.create()
        self.config = replace(
            CONFIG, memory=self.memory.path, clock_origin=CLOCK.origin, limits=LIMITS
        )
        self.beats = 0
        self.give_patch(PLANE.tick)

    def give_patch(self, tick: int) -> None:
        self.memory.patch.write(replace(PLANE, tick=tick).encode())

    def command(self, *, stop: bool) -> None:
        self.beats += 1
        self.memory.command.write(COMMAND.pack(self.beats, stop))

    def stop_after(self, periods: int) -> Callable[[int], None]:
        return lambda reads: self.command(stop=True) if reads == periods else None

    def status(self) -> dict[str, object]:
        seen: dict[str, object] = json.loads(self.memory.status.read() or b"{}")
        return seen

    def run(self, rig: Rig) -> tuple[HapticLoop, list[Row]]:
        """The loop over a rig, to its end."""
        memory = LoopMemory(self.memory.path)
        loop = HapticLoop(self.config, memory, rig, prefer=False)
        loop.run()
        memory.close(remove=False)
        return loop, self.memory.rows.read_new()


@pytest.fixture
def parent() -> Iterator[Parent]:
    made = Parent()
    yield made
    made.memory.close(remove=True)


# Periods


def test_each_period_reads_then_writes_and_leaves_one_row(parent: Parent) -> None:
    rig = Rig(parent.stop_after(150))
    loop, rows = parent.run(rig)
    assert len(rows) == rig.reads == loop.statistics.late.count
    assert ["read" if entry == "read" else "write" for entry in rig.log] == [
        "read",
        "write",
    ] * rig.reads
    assert [(row.fx, row.fy, row.fz) for row in rows] == rig.forces
    assert {row.tick for row in rows} == {PLANE.tick}
    assert all(a.t < b.t for a, b in pairwise(rows))
    assert all(row.late >= 0.0 for row in rows)


def test_the_newest_sample_is_the_last_row(parent: Parent) -> None:
    _, rows = parent.run(Rig(parent.stop_after(50)))
    raw = parent.memory.sample.read()
    assert raw is not None
    last = rows[-1]
    assert SAMPLE.unpack(raw) == (last.t, last.tick, *last[1:7])


def test_told_to_stop_it_fades_to_zero_force_and_ends(parent: Parent) -> None:
    rig = Rig(parent.stop_after(150))
    loop, rows = parent.run(rig)
    assert not loop.orphaned
    sizes = [norm(force) for force in rig.forces]
    assert max(sizes) == pytest.approx(FORCE)
    assert rig.forces[-1] == ZERO
    fade = sizes[150:]  # the last that may be full, up to the next look at commands
    assert fade == sorted(fade, reverse=True)
    # A late period counts as two.
    steepest = SAFETY_FADE_RATE * 2.0 * parent.config.haptic_period
    assert all(a - b <= steepest + 1e-9 for a, b in pairwise(fade))
    # A fade, a look at commands, and the leave of a busy machine.
    fade_time = max(LIMITS.fade_time, FORCE / SAFETY_FADE_RATE)
    assert rows[-1].t - rows[149].t < fade_time + 0.05 + 0.2


def test_told_to_stop_while_nothing_is_pressed_it_ends_at_once(parent: Parent) -> None:
    """A fade as slow as a large force needs is not waited for."""
    _, rows = parent.run(Rig(parent.stop_after(100), pressed=OUTSIDE))
    assert rows[-1].t - rows[99].t < 0.05 + 0.2
    assert {(row.fx, row.fy, row.fz) for row in rows} == {ZERO}


def test_patches_that_come_after_the_word_to_stop_change_nothing(parent: Parent) -> None:
    def each(reads: int) -> None:
        if reads >= 100:
            parent.command(stop=True)
            parent.give_patch(reads)

    rig = Rig(each)
    _, rows = parent.run(rig)
    assert rig.forces[-1] == ZERO
    assert rows[-1].tick == rows[-10].tick


def test_without_a_heartbeat_it_fades_and_ends_by_itself(
    parent: Parent, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(loop_process, "ORPHANED_AFTER", 0.15)
    rig = Rig(lambda reads: parent.command(stop=False) if reads < 100 else None)
    loop, rows = parent.run(rig)
    assert loop.orphaned
    assert rows[-1].t - rows[0].t > 0.15
    assert max(norm(force) for force in rig.forces) > 0.0
    assert rig.forces[-1] == ZERO


def test_a_period_that_takes_too_long_is_counted_and_the_phase_is_kept(parent: Parent) -> None:
    stop = parent.stop_after(60)

    def each(reads: int) -> None:
        stop(reads)
        if reads == 30:
            CLOCK.sleep_until(CLOCK.now() + 0.005)

    loop, rows = parent.run(Rig(each))
    assert loop.statistics.missed >= 4
    period = parent.config.haptic_period
    for row in rows:
        cycles = (row.t - row.late - rows[0].t + rows[0].late) / period
        # Time in days resolves some picoseconds; a thousandth of a period is far above.
        assert cycles == pytest.approx(round(cycles), abs=1e-3)


def test_it_reports_how_it_does(parent: Parent) -> None:
    parent.run(Rig(parent.stop_after(100)))
    status = parent.status()
    assert set(status) == {
        "loop_hz", "late_p50", "late_p99", "cost_p50", "missed", "mode", "fault", "scheduling",
    }  # fmt: skip
    assert (status["mode"], status["fault"], status["scheduling"]) == ("engaged", "", "as it was")


def test_a_fault_is_in_the_report(parent: Parent) -> None:
    parent.config = replace(parent.config, limits=replace(LIMITS, stall=0.004))
    stop = parent.stop_after(200)

    def each(reads: int) -> None:
        stop(reads)
        if reads == 100:
            CLOCK.sleep_until(CLOCK.now() + 0.02)

    rig = Rig(each)
    parent.run(rig)
    # It is let go, without a jerk, in so many periods; the remainder is rounding.
    sizes = [norm(force) for force in rig.forces[99:]]
    assert sizes == sorted(sizes, reverse=True)
    steepest = 1.5 * sizes[0] / FAULT_RELEASE_TIME * 2.0 * parent.config.haptic_period
    assert all(a - b <= steepest + 1e-9 for a, b in pairwise(sizes))
    released = math.ceil(FAULT_RELEASE_TIME / parent.config.haptic_period) + 2
    assert set(rig.forces[99 + released :]) == {ZERO}  # the tip is inside: none until it was out
    assert "the loop stood still for" in str(parent.status()["fault"])


@given(st.text(max_size=400), st.text(max_size=20))
@example("\U0001f635" * 400, "\x00" * 20)  # the most bytes
def test_any_report_fits_its_slot(error: str, other: str) -> None:
    memory = LoopMemory.create()
    reader = LoopMemory(memory.path)
    memory.status.write(status_json(error=error, other=other))
    seen = json.loads(reader.status.read() or b"{}")
    assert seen["other"] == other
    assert error.startswith(seen["error"])
    assert len(seen["error"]) == min(len(error), 300)
    reader.close(remove=False)
    memory.close(remove=True)


# The process


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

        monkeypatch.setattr(sys, "argv", ["loop_process", parent.config.to_json()])
        monkeypatch.setattr(loop_process, "open_device", opened)

        def as_it_was(_priority: int) -> str:
            return "as it was"

        monkeypatch.setattr(loop_process, "prefer_this_process", as_it_was)
        loop_process.main()

    ctrl_c = signal.getsignal(signal.SIGINT)
    yield run
    signal.signal(signal.SIGINT, ctrl_c)
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


class Broken(Rig):
    """A device whose driver raises at every write once it broke."""

    def __init__(self, error: Exception) -> None:
        super().__init__()
        self.error = error

    def write(self, force: Vec3) -> None:
        super().write(force)
        if self.reads >= 50:
            raise self.error


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
def test_trouble_in_the_device_means_zero_force_twice_then_close_then_the_report(
    parent: Parent, main: Main, error: Exception, words: str
) -> None:
    watching = LoopMemory(parent.memory.path)
    rig = Watched(fail_after(100, error), watching.status)
    with pytest.raises((SystemExit, ValueError)):
        main(rig)
    assert norm(rig.forces[98]) == pytest.approx(FORCE)  # in the period before the trouble
    assert after_the_last_read(rig)[:3] == [ZERO, ZERO, "close"]
    assert not any(rig.reported[: 99 + 2])
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
    assert after_the_last_read(rig)[1:4] == [ZERO, ZERO, "close"]
    assert "gone" in str(parent.status()["error"])


def test_a_device_that_cannot_be_had_ends_the_process_with_its_sentence(
    parent: Parent, main: Main
) -> None:
    with pytest.raises(SystemExit) as ended:
        main(DeviceError("spacemouse", "no SpaceMouse was found", "plug one in"))
    assert ended.value.code == 2
    assert parent.status() == {"error": "spacemouse: no SpaceMouse was found; plug one in"}


def test_told_to_stop_the_process_ends_without_a_word_and_lets_go(
    parent: Parent, main: Main
) -> None:
    rig = Rig(parent.stop_after(50))
    main(rig)
    assert rig.log[-3:] == [ZERO, ZERO, "close"]
    assert "error" not in parent.status()


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
