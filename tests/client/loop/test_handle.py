"""The loop's real process, started and ended by its real handle. Real time, so few and short."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path

import pytest

from cohaptic.clock import SystemClock
from cohaptic.errors import DeviceError
from cohaptic.status.row import Row, rows_in
from cohaptic.vec import ZERO, norm
from cohaptic_client.devices.kind import DeviceChoice
from cohaptic_client.devices.spacemouse import open_spacemouse
from cohaptic_client.loop.config import LoopConfig
from cohaptic_client.loop.handle import HapticProcess
from cohaptic_client.loop.memory import SAMPLE, LoopMemory
from cohaptic_client.loop.running.haptic_loop import ORPHANED_AFTER
from cohaptic_client.loop.safety import SAFETY_FADE_RATE
from tests.client.plane import CONFIG, DEPTH, PLANE, PRESSED_FORCE, STIFFNESS
from tests.patience import PATIENCE

pytestmark = pytest.mark.alone

CLOCK = SystemClock()
LOOK = 0.01  # s between looks at the process


def force(row: Row) -> float:
    return norm((row.fx, row.fy, row.fz))


@dataclass
class Bench:
    """The network process: patches, heartbeats, and all that came back."""

    memory: LoopMemory
    rows: list[Row] = field(default_factory=list[Row])
    tick: int = 0

    @property
    def config(self) -> LoopConfig:
        return replace(CONFIG, memory=self.memory.path, clock_origin=CLOCK.origin)

    def until(self, loop: HapticProcess, condition: Callable[[], bool]) -> None:
        """Live as the client does until something is so."""
        deadline = CLOCK.now() + PATIENCE
        while not condition():
            assert CLOCK.now() < deadline, loop.status
            self.tick += 1
            loop.give_patch(replace(PLANE, tick=self.tick).encode())
            loop.beat()
            self.rows += rows_in(loop.new_rows())
            CLOCK.sleep_until(CLOCK.now() + LOOK)

    def stand_still(self, loop: HapticProcess) -> None:
        """Until the loop is gone; its memory goes with it."""
        deadline = CLOCK.now() + PATIENCE
        while os.path.exists(self.memory.path):
            assert CLOCK.now() < deadline
            CLOCK.sleep_until(CLOCK.now() + LOOK)
        loop.wait()


@pytest.fixture
def bench() -> Iterator[Bench]:
    memory = LoopMemory.create()
    yield Bench(memory)
    memory.close(remove=True)


def end(loop: HapticProcess) -> None:
    loop.request_stop()
    loop.wait()


def processes_with(path: str) -> list[int]:
    """Numbers of the running processes that have a path on their command line."""
    found = list[int]()
    for pid in filter(str.isdigit, os.listdir("/proc")):
        try:
            command = Path("/proc", pid, "cmdline").read_bytes()
        except OSError:
            continue  # it ended meanwhile
        if path.encode() in command:
            found.append(int(pid))
    return found


def test_patches_go_in_rows_and_samples_come_out_and_the_end_is_a_fade_to_zero(
    bench: Bench,
) -> None:
    loop = HapticProcess(bench.config, bench.memory)
    assert loop.newest_sample() is None
    rows = bench.rows
    bench.until(loop, lambda: bool(rows) and force(rows[-1]) > 0.98 * PRESSED_FORCE)

    tip = loop.newest_sample()
    assert tip is not None
    assert tip.t >= rows[-1].t
    assert tip.tick >= rows[-1].tick > 1
    assert tip.probe[2] < 0.0
    assert norm(tip.force) == pytest.approx(PRESSED_FORCE, rel=0.05)
    assert loop.status["mode"] == "engaged"

    loop.request_stop()
    reported = CLOCK.now()
    loop.beat()  # whoever beats on does not take the word back
    loop.wait()
    rows += rows_in(loop.new_rows())
    last = loop.newest_sample()
    assert last is not None
    assert last.force == ZERO
    assert loop.newest_sample() == last  # it stays, when there is no newer one
    assert force(rows[-1]) == 0.0
    # It ended by itself: a fade, in which the hand sinks in to where it wants to be, and the leave
    # of a busy machine.
    fade_time = max(CONFIG.limits.fade_time, STIFFNESS * DEPTH / SAFETY_FADE_RATE)
    assert rows[-1].t - reported < fade_time + 0.5
    fade = [force(row) for row in rows if row.t > reported]
    steepest = PRESSED_FORCE / CONFIG.limits.fade_time
    for a, b in pairwise(rows):
        assert a.t < b.t
        if a.t > reported:
            # No faster than the fade; the hand springs back meanwhile, which only adds a little.
            assert abs(force(b) - force(a)) < 2.5 * steepest * (b.t - a.t) + 0.01
    assert fade[0] > 0.9 * PRESSED_FORCE


@pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc and /dev/shm")
def test_neither_a_process_nor_a_file_stays_behind() -> None:
    memory = LoopMemory.create()
    bench = Bench(memory)
    loop = HapticProcess(bench.config, memory)
    bench.until(loop, lambda: bool(bench.rows))
    assert len(processes_with(memory.path)) == 1
    end(loop)
    memory.close(remove=True)
    assert processes_with(memory.path) == []
    assert not os.path.exists(memory.path)


def test_without_its_parents_heartbeat_it_fades_and_ends(bench: Bench) -> None:
    """As when the network process was killed: no word to stop, no beat, no patch, no clean-up."""
    command = [sys.executable, "-m", "cohaptic_client.loop.process", bench.config.to_json()]
    started = CLOCK.now()
    with subprocess.Popen(command, stdin=subprocess.DEVNULL) as orphan:
        assert orphan.wait(PATIENCE) == 0
    assert CLOCK.now() - started > ORPHANED_AFTER
    raw = bench.memory.sample.read()
    assert raw is not None
    assert SAMPLE.unpack(raw)[5:8] == ZERO
    if sys.platform != "win32":  # where a file stays as long as this process has it mapped
        assert not os.path.exists(bench.memory.path)


def test_a_device_that_cannot_be_had_is_one_sentence(bench: Bench) -> None:
    try:
        open_spacemouse(CONFIG.device.center, reach=0.1).close()
    except DeviceError as error:
        expected = str(error)
    else:
        pytest.skip("a SpaceMouse is plugged in")
    device = replace(CONFIG.device, choice=DeviceChoice("spacemouse"))
    loop = HapticProcess(replace(bench.config, device=device), bench.memory)
    with pytest.raises(DeviceError) as caught:
        bench.until(loop, lambda: False)
    assert str(caught.value) == expected
    assert "\n" not in expected
    end(loop)


def test_a_process_that_dies_without_a_word_is_one_sentence_too(
    bench: Bench, capfd: pytest.CaptureFixture[str]
) -> None:
    loop = HapticProcess(replace(bench.config, memory="/nowhere"), bench.memory)
    with pytest.raises(DeviceError, match=r"^simulated: its process ended with 1; start again$"):
        bench.until(loop, lambda: False)
    end(loop)
    assert "/nowhere" in capfd.readouterr().err  # the whole story, for a bug report


@pytest.mark.skipif(sys.platform == "win32", reason="needs POSIX signals")
def test_a_process_that_does_not_end_is_ended(bench: Bench) -> None:
    loop = HapticProcess(bench.config, bench.memory)
    bench.until(loop, lambda: bool(bench.rows))
    (pid,) = processes_with(bench.memory.path)
    os.kill(pid, signal.SIGSTOP)  # as a driver that never returns: it hears no word to stop
    end(loop)
    assert processes_with(bench.memory.path) == []


@pytest.mark.skipif(sys.platform == "win32", reason="the file stays while it is mapped")
def test_a_program_that_stood_still_is_told_why_its_loop_is_gone(bench: Bench) -> None:
    """As after Ctrl-Z and `fg`: the loop let the hand go meanwhile, and ended."""
    loop = HapticProcess(bench.config, bench.memory)
    bench.until(loop, lambda: bool(bench.rows))
    bench.stand_still(loop)
    with pytest.raises(DeviceError, match=r"heard nothing of this program for 2 s.*; start again$"):
        loop.beat()
    end(loop)
