"""The haptic loop over a device: reads the tip, runs `step`, writes the force, shares the results.

Work that need not be done in every period is done at housekeeping, 20 times a second: the parent's
commands, the newest row if the recording of every row is off, and at intervals the state's report.

The loop takes a new patch over from the shared memory in parts, one part in each period. Code and
data for an arrival are used only once in a simulation period and are in no cache of the processor:
all parts in one period would make it three times as long as the others. The loop finishes one patch
before it begins the next, so that it uses patches even if they come as often as periods.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from cohaptic.clock import SystemClock
from cohaptic.control.mesh_surface import Surface
from cohaptic.protocol.patch import Patch
from cohaptic.protocol.rest_mesh import RestMesh
from cohaptic.status.quantiles import Tally
from cohaptic.status.reason import STALLED
from cohaptic.vec import ZERO, Vec3
from cohaptic_client.devices.device import Device, DeviceSample
from cohaptic_client.loop.added import RuleChoice, chain_with
from cohaptic_client.loop.arrival import receive
from cohaptic_client.loop.config import LoopConfig, limits_on
from cohaptic_client.loop.memory import COMMAND, SAMPLE, LoopMemory, Slots
from cohaptic_client.loop.period import Period
from cohaptic_client.loop.rows import row_of
from cohaptic_client.loop.running.watchdog import Watchdog
from cohaptic_client.loop.safety import SAFETY_FADE_RATE, Mode
from cohaptic_client.loop.state import LoopSettings, LoopState, SurfaceMaker
from cohaptic_client.loop.step import step


class Intake:
    """Takes a patch from the shared memory in parts, one in each period.

    The parts: read the frame, make the surface, pass both on. A plane or sphere comes into use one
    period after its frame is read, a mesh patch two periods.

    Args:
        slots: Slots with the newest frames. The network process has decoded each frame before, and
            has refused invalid ones.
        make: Function that makes the surface of a patch.

    Attributes:
        patch: Patch to be used once `advance` has returned True.
        surface: Surface of that patch.
    """

    def __init__(self, slots: Slots, make: Callable[[Patch], Surface]) -> None:
        self._slots: Final = slots
        self._make: Final = make
        self._begun: Patch | None = None
        self.patch: Patch | None = None
        self.surface: Surface | None = None

    def advance(self) -> bool:
        """Do this period's part of the work; return whether `patch` is to be used now."""
        patch = self._begun
        if patch is None:
            frame = self._slots.read()
            if frame is not None:
                self._begun = Patch.decode_checked(frame)
            return False
        if self.patch is not patch:
            self.patch, self.surface = patch, self._make(patch)
            if patch.neighbourhood is not None:
                return False
        self._begun = None
        return True


# s without a heartbeat of the network process: by then a silent server has been noticed (1 s at
# most) and 10 N have faded at 10 N/s. Reasoned, not measured.
ORPHANED_AFTER = 2.0
# s between looks at commands: nobody notices an end that comes so much later, and 49 of 50 periods
# are spared the look. Reasoned, not measured.
HOUSEKEEPING: Final = 0.05
# s between reports of the state: as often as a person reads a status line; a new fault is reported
# at once. Reasoned, not measured.
REPORT: Final = 0.25
# s after the start in which lateness and cost are not counted: code and data are not in the caches
# yet, and the parent is still busy with its own start. The length is reasoned, not measured.
WARM_UP: Final = 0.5
# Bound once, because the look-up of an enum member takes time in every period (see `safety`).
_ENGAGED: Final = Mode.ENGAGED


@dataclass
class Statistics:
    """Punctuality of the loop; only `periods` includes the first `WARM_UP` [s].

    Args:
        late: Lateness of each period [s].
        cost: Computing time of each period, from waking to sleeping [s].
        missed: Number of periods that were skipped because the period before was too late.
        periods: Number of periods of the whole run.
    """

    late: Tally = field(default_factory=Tally)
    cost: Tally = field(default_factory=Tally)
    missed: int = 0
    periods: int = 0


class HapticLoop:
    """The haptic loop over an opened device.

    Args:
        memory: Memory shared with the network process.
        scheduling: Scheduling that the system has granted to this process, in words.
        watchdog: Watchdog of the device; None if another thread cannot release the device.
        engaged: Function that is called once, with the time at which the hand can feel a force for
            the first time [s]; None for none.
        rules: Rules of other packages, in the order in which they act.

    Attributes:
        statistics: Punctuality of the loop.
        orphaned: Whether the loop ends because the network process is gone.
        interrupted: Name of the signal that ends the loop; empty for none.
        written: Last force that the device was given [N].
    """

    def __init__(
        self,
        config: LoopConfig,
        memory: LoopMemory,
        device: Device,
        scheduling: str = "as it was",
        watchdog: Watchdog | None = None,
        engaged: Callable[[float], None] | None = None,
        rules: Sequence[RuleChoice] = (),
    ) -> None:
        self._memory = memory
        self._device = device
        self._scheduling = scheduling
        self._watchdog = watchdog
        self._engaged = engaged
        self._clock = SystemClock(config.clock_origin)
        self._haptic_period = config.haptic_period
        self._every_row = config.every_row
        self._limits = limits_on(config.limits, device.info)
        self._settings = LoopSettings(
            config.simulation_period,
            self._limits,
            config.law,
            config.smoothing,
            config.max_damping,
            surface=SurfaceMaker(_rest_mesh(config.rest_mesh)),
            friction=config.friction,
            follow=config.follow,
            max_stiffness=device.info.max_stiffness,
        )
        self._state = LoopState()
        if config.fault:
            self._state = self._state.taken_away(config.fault, self._limits)
        self._chain = chain_with(rules)
        self._intake = Intake(memory.patch, self._settings.surface)
        self.statistics = Statistics()
        memory.rows.prepare()
        self._started = self._clock.now()
        self._heard = self._started
        self._ends = math.inf
        self._reported_fault = self._slow = ""
        self._faults, self._last_fault = 0, ""
        self._heard_device = True
        self._acknowledged = 0
        self._took = 0.0  # by the last period [s]
        self.orphaned = False
        self.interrupted = ""
        self.written: Vec3 = ZERO

    def run(self) -> None:
        """Run until a command, a signal, a missing heartbeat or an error ends the loop.

        On a command, or without heartbeats, the loop fades the force to zero first. After a signal
        or an error the caller has to take away the force of that moment (`entry.Release`).
        """
        clock, period, statistics = self._clock, self._haptic_period, self.statistics
        due = housekeeping = report = clock.now()
        warm = due + WARM_UP
        while due < self._ends and not self.interrupted:
            due += period
            clock.sleep_until(due)
            now = clock.now()
            late = now - due
            self._period(now, late, now >= housekeeping)
            if now >= housekeeping:
                housekeeping = now + HOUSEKEEPING
                self._obey(now)
                if now >= report or self._state.safety.fault != self._reported_fault:
                    report = now + REPORT
                    self._report(now)
            statistics.periods += 1
            missed = int(late / period)
            due += missed * period
            self._took = clock.now() - now
            if now >= warm:
                statistics.missed += missed
                statistics.late.add(late)
                statistics.cost.add(self._took)
        self._report(clock.now())

    def _period(self, now: float, late: float, keep_row: bool) -> None:
        intake = self._intake
        if intake.advance() and self._ends == math.inf:
            assert intake.patch is not None
            self._state = receive(self._state, intake.patch, now, self._settings, intake.surface)
        watchdog = self._watchdog
        if watchdog is not None:
            watchdog.since = now
        sample = self._device.read(now)
        self._heard_device = sample.fresh
        self._state, period = step(self._state, sample, now, self._settings, self._chain)
        if self._engaged is not None and self._state.safety.mode is _ENGAGED:
            self._engaged(now)
            self._engaged = None
        if watchdog is not None and watchdog.fired:
            self._begin_at_zero(watchdog, period)
        self.written = period.force  # before the call: a failed write may have given the force
        self._device.write(period.force)
        if watchdog is not None:
            if watchdog.fired:  # the write held up the loop, and may have undone the release
                self._begin_at_zero(watchdog, period)
                self.written = ZERO
                self._device.write(ZERO)
            watchdog.since = math.inf
        faded = self._ends < math.inf and period.force == ZERO
        if faded:
            self._ends = -math.inf
        # The place that was used: what is no place is no matter for the server.
        self._publish(period.sample, period, now)
        if self._every_row or keep_row or faded:
            self._memory.rows.append(row_of(self._state, sample, period, now, late))

    def interrupt(self, signal: str) -> None:
        """End the loop before its next period; a signal handler calls this."""
        self.interrupted = signal

    def _begin_at_zero(self, watchdog: Watchdog, period: Period) -> None:
        """Set period and state to zero force, after the watchdog has released the device."""
        watchdog.begin()
        watchdog.fired = False
        fault = f"the device held up the loop for more than {1e3 * self._limits.stall:g} ms"
        self._state = self._state.taken_away(fault, self._limits)
        period.take_force_away()

    def _obey(self, now: float) -> None:
        """Read the parent's commands; start to fade out on a stop or without heartbeats."""
        command, commanded = self._memory.command.read(), False
        if command is not None:
            self._heard = now
            _, commanded, every_row, acknowledged = COMMAND.unpack(command)
            self._every_row = every_row
            if acknowledged != self._acknowledged:
                self._acknowledged = acknowledged
                self._state = self._state.acknowledged()
        if self._ends == math.inf and (commanded or now - self._heard > ORPHANED_AFTER):
            # From now on the server counts as silent, so the force fades before the end.
            self._state = self._state.silenced()
            limits = self._limits
            fade = max(limits.fade_time, limits.max_force / SAFETY_FADE_RATE)
            self._ends = now + fade + 0.01
            self.orphaned = not commanded

    def _report(self, now: float) -> None:
        statistics, safety = self.statistics, self._state.safety
        fault = safety.fault
        if fault and fault != self._reported_fault:
            if safety.cause == STALLED and self._took > self._limits.stall:
                name, took = self._device.info.name, 1e3 * self._took
                self._slow = f", since read or write of {name} took {took:.0f} ms"
            else:
                self._slow = ""
            self._faults, self._last_fault = self._faults + 1, fault + self._slow
        self._reported_fault = fault
        fault += self._slow if fault else ""
        self._memory.status.write(
            status_json(
                loop_hz=statistics.periods / max(1e-9, now - self._started),
                warm_up=WARM_UP,
                late_p50=statistics.late.quantile(0.5),
                late_p99=statistics.late.quantile(0.99),
                cost_p50=statistics.cost.quantile(0.5),
                cost_p99=statistics.cost.quantile(0.99),
                missed=statistics.missed,
                wavers=self._state.playout.wavers,
                mode=safety.mode.value,
                fault=fault,
                faults=self._faults,
                last_fault=self._last_fault,
                device_silent=not self._heard_device,
                scheduling=self._scheduling,
            )
        )

    def _publish(self, sample: DeviceSample, period: Period, now: float) -> None:
        patch = self._state.patch
        tick = patch.tick if patch is not None else 0
        x, y, z = sample.position
        fx, fy, fz = period.on_body
        anchor = period.anchor
        ax, ay, az = anchor or ZERO
        holds = anchor is not None
        deflection = period.deflection
        raw = SAMPLE.pack(
            now,
            tick,
            x,
            y,
            z,
            fx,
            fy,
            fz,
            holds,
            ax,
            ay,
            az,
            deflection is not None,
            deflection or 0.0,
        )
        self._memory.sample.write(raw)


def _rest_mesh(path: str | None) -> RestMesh | None:
    """Read the resting mesh from the file that the network process wrote; None without a path."""
    return None if path is None else RestMesh.decode(Path(path).read_bytes())


def status_json(**values: object) -> bytes:
    """Encode a report of the loop as JSON, with its texts cut to fit the slot."""
    values = {k: v[:300] if isinstance(v, str) else v for k, v in values.items()}
    return json.dumps(values).encode()
