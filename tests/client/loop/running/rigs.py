"""A scripted device and a parent for the tests of the loop's process."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace

from cohaptic.clock import SystemClock
from cohaptic.status.row import Row, rows_in
from cohaptic.vec import ZERO, Vec3
from cohaptic_client.devices.device import DeviceInfo, DeviceSample
from cohaptic_client.loop.memory import COMMAND, LoopMemory
from cohaptic_client.loop.running.haptic_loop import HapticLoop
from cohaptic_client.loop.safety import SafetyLimits
from tests.client.plane import CONFIG, PLANE, STIFFNESS

CLOCK = SystemClock()
# One patch is enough for a test; a hiccup of the machine is no fault, nor is a tip that jumps.
LIMITS = SafetyLimits(silent_after=60.0, fade_time=0.03, engage_time=0.01, stall=60.0, stale=60.0)
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
        self.memory.command.write(COMMAND.pack(self.beats, stop, self.config.every_row, 0))

    def stop_after(self, periods: int) -> Callable[[int], None]:
        return lambda reads: self.command(stop=True) if reads == periods else None

    def status(self) -> dict[str, object]:
        seen: dict[str, object] = json.loads(self.memory.status.read() or b"{}")
        return seen

    def run(self, rig: Rig) -> tuple[HapticLoop, list[Row]]:
        """The loop over a rig, to its end."""
        memory = LoopMemory(self.memory.path)
        loop = HapticLoop(self.config, memory, rig)
        loop.run()
        memory.close(remove=False)
        return loop, rows_in(self.memory.rows.read_new())
