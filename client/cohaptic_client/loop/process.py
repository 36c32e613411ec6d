"""The haptic loop: a process of its own, so that nothing of the network can delay it.

    python -m cohaptic_client.loop.process CONFIG

It reads the device, runs `step`, writes the force, and exchanges newest values with the network
process through shared memory. It ends on command, or when the network process is gone; the last
force is always zero.
"""

from __future__ import annotations

import contextlib
import gc
import json
import math
import signal
import struct
import sys
from dataclasses import dataclass, field
from pathlib import Path

from cohaptic.clock import SystemClock
from cohaptic.errors import CohapticError
from cohaptic.protocol.patch import Patch
from cohaptic.protocol.rest_mesh import RestMesh
from cohaptic.runtime.scheduling import LOOP_PRIORITY, prefer_this_process
from cohaptic.status.quantiles import Tally
from cohaptic.status.row import Row
from cohaptic.vec import ZERO, norm
from cohaptic_client.devices.catalogue import open_device
from cohaptic_client.devices.device import Device, DeviceSample
from cohaptic_client.loop.arrival import receive
from cohaptic_client.loop.config import LoopConfig
from cohaptic_client.loop.memory import LoopMemory
from cohaptic_client.loop.safety import SAFETY_FADE_RATE
from cohaptic_client.loop.state import LoopSettings, LoopState, Output
from cohaptic_client.loop.step import step
from cohaptic_client.loop.surfaces import SurfaceMaker

COMMAND = struct.Struct("<Q?")  # heartbeat, stop
SAMPLE = struct.Struct("<dI6d")  # time, tick of the patch in use, probe, force on body
ORPHANED_AFTER = 2.0  # s without a heartbeat of the network process
HOUSEKEEPING = 0.05  # s between looks at commands and reports of the state


@dataclass
class Statistics:
    """How punctual the loop was.

    Args:
        late: Lateness of each period [s].
        cost: Of each period, from waking to sleeping [s].
        missed: Periods left out because the one before was too late.
    """

    late: Tally = field(default_factory=Tally)
    cost: Tally = field(default_factory=Tally)
    missed: int = 0


class HapticLoop:
    """The loop over a device; `run` returns when the force has faded.

    Args:
        config: Of the loop.
        memory: Shared with the network process.
        device: To be read and written.
        prefer: Ask the system for better scheduling.

    Attributes:
        statistics: How punctual the loop is.
        orphaned: Whether it ends because the network process is gone.
    """

    def __init__(
        self, config: LoopConfig, memory: LoopMemory, device: Device, *, prefer: bool = True
    ) -> None:
        self._config = config
        self._memory = memory
        self._device = device
        self._clock = SystemClock(config.clock_origin)
        self._settings = LoopSettings(
            config.simulation_period,
            config.limits,
            config.law,
            config.smoothing,
            config.max_damping,
            surface=SurfaceMaker(_rest_mesh(config.rest_mesh)),
            friction=config.friction,
            follow=config.follow,
            max_stiffness=device.info.max_stiffness,
        )
        self._state = LoopState()
        self.statistics = Statistics()
        self._scheduling = prefer_this_process(LOOP_PRIORITY) if prefer else "as it was"
        self._started = self._clock.now()
        self._heard = self._started
        self._ends = math.inf
        self.orphaned = False

    def run(self) -> None:
        """Run until told to stop, orphaned, or the device fails."""
        clock, period, statistics = self._clock, self._config.haptic_period, self.statistics
        due = housekeeping = clock.now()
        while due < self._ends:
            due += period
            clock.sleep_until(due)
            now = clock.now()
            late = now - due
            self._period(now, late)
            if now >= housekeeping:
                housekeeping = now + HOUSEKEEPING
                self._obey(now)
                self._report()
            statistics.late.add(late)
            statistics.cost.add(clock.now() - now)
            if late > period:
                missed = int(late / period)
                statistics.missed += missed
                due += missed * period

    def _period(self, now: float, late: float) -> None:
        frame = self._memory.patch.read()
        if frame is not None and self._ends == math.inf:
            self._state = receive(self._state, Patch.decode(frame), now, self._settings)
        sample = self._device.read(now)
        self._state, output = step(self._state, sample, now, self._settings)
        self._device.write(output.force)
        if self._ends < math.inf and output.force == ZERO:
            self._ends = -math.inf  # it has faded
        self._publish(sample, output, now, late)

    def _obey(self, now: float) -> None:
        """Look for a heartbeat and the command to stop."""
        command = self._memory.command.read()
        if command is not None:
            self._heard = now
        commanded = command is not None and COMMAND.unpack(command)[1]
        if self._ends == math.inf and (commanded or now - self._heard > ORPHANED_AFTER):
            # From now on the server counts as silent, so the force fades before the end.
            self._state = self._state._replace(arrived=-math.inf)
            limits = self._config.limits
            fade = max(limits.fade_time, limits.max_force / SAFETY_FADE_RATE)
            self._ends = now + fade + 0.01
            self.orphaned = not commanded

    def _report(self) -> None:
        statistics, safety = self.statistics, self._state.safety
        self._memory.status.write(
            status_json(
                loop_hz=statistics.late.count / max(1e-9, self._clock.now() - self._started),
                late_p50=statistics.late.quantile(0.5),
                late_p99=statistics.late.quantile(0.99),
                cost_p50=statistics.cost.quantile(0.5),
                missed=statistics.missed,
                mode=safety.mode.value,
                fault=safety.fault,
                scheduling=self._scheduling,
            )
        )

    def _publish(self, sample: DeviceSample, output: Output, now: float, late: float) -> None:
        patch, local = self._state.patch, output.local
        tick = patch.tick if patch else 0
        self._memory.sample.write(SAMPLE.pack(now, tick, *sample.position, *output.on_body))
        self._memory.rows.append(
            Row(
                now,
                *sample.position,
                *output.force,
                local.normal_force,
                local.felt_from_others,
                output.u_others,
                local.indentation,
                self._state.k_h,
                output.damping_force,
                patch.k_o if patch else 0.0,
                sample.level,
                self._state.safety.scale,
                late,
                tick,
                now - self._state.arrived if patch else 0.0,
                patch.room.lag if patch else 0.0,
                self._state.safety.scale * norm(self._state.friction.force),
            )
        )


def _rest_mesh(path: str | None) -> RestMesh | None:
    """The mesh in the file that the network process wrote."""
    return None if path is None else RestMesh.decode(Path(path).read_bytes())


def status_json(**values: object) -> bytes:
    """A status as the network process reads it, cut to the size of its slot."""
    values = {k: v[:300] if isinstance(v, str) else v for k, v in values.items()}
    return json.dumps(values).encode()


def main() -> None:
    """Entry point of the process."""
    # Ctrl-C reaches every process of a terminal; this one ends when its parent says so.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    config = LoopConfig.from_json(sys.argv[1])
    memory = LoopMemory(config.memory)
    try:
        device = open_device(config.device)
    except CohapticError as error:
        memory.status.write(status_json(error=str(error)))
        sys.exit(2)
    # The loop makes no cycles; a collection could cost several periods.
    gc.collect()
    gc.freeze()
    gc.disable()
    orphaned = False
    try:
        loop = HapticLoop(config, memory, device)
        loop.run()
        orphaned = loop.orphaned
    except CohapticError as error:
        _let_go(device)
        memory.status.write(status_json(error=str(error)))
        sys.exit(2)
    except Exception as error:
        # The hand first, then the report.
        _let_go(device)
        memory.status.write(status_json(error=f"the haptic loop failed: {error!r}"))
        raise
    finally:
        _let_go(device)
        # Its maker removes the file, unless it was killed.
        memory.close(remove=orphaned)
        if orphaned and config.rest_mesh is not None:
            Path(config.rest_mesh).unlink(missing_ok=True)


def _let_go(device: Device) -> None:
    """Zero force, twice, then close; whatever the device answers."""
    for _ in range(2):
        with contextlib.suppress(Exception):
            device.write(ZERO)
    with contextlib.suppress(Exception):
        device.close()


if __name__ == "__main__":
    main()
