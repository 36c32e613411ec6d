"""The life of the loop's process: open the device, run the loop, let go whatever happened.

It ends on command, on a signal, or when the network process is gone; the last force is always zero.
"""

from __future__ import annotations

import atexit
import gc
import sys
from pathlib import Path
from typing import Final

from cohaptic.clock import SystemClock
from cohaptic.errors import CohapticError, DeviceError
from cohaptic.runtime.scheduling import LOOP_PRIORITY, lock_memory, prefer_this_process
from cohaptic.vec import ZERO
from cohaptic_client.devices.catalogue import open_device
from cohaptic_client.devices.device import Device
from cohaptic_client.devices.placing.options import clutch_is_switch
from cohaptic_client.loop.config import LoopConfig
from cohaptic_client.loop.memory import LoopMemory
from cohaptic_client.loop.running.haptic_loop import ORPHANED_AFTER, HapticLoop, status_json
from cohaptic_client.loop.running.letting_go import Release
from cohaptic_client.loop.running.signals import handle_signals
from cohaptic_client.loop.running.watchdog import Releasable, Watchdog

STOOD_STILL: Final = (
    f"its loop heard nothing of this program for {ORPHANED_AFTER:g} s, as when that is stopped or "
    "the machine is too busy, and has let the hand go; start again"
)


def live(text: str) -> None:
    """Run the loop of a configuration, as `LoopConfig.to_json` wrote it, to its end."""
    config = LoopConfig.from_json(text)
    memory = LoopMemory(config.memory)
    clock = SystemClock(config.clock_origin)
    loop: HapticLoop | None = None
    early = list[str]()

    def end(signal: str) -> None:
        if loop is None:
            early.append(signal)
        else:
            loop.interrupt(signal)

    handle_signals(end)
    try:
        device = _opened(config)
    except CohapticError as error:
        memory.status.write(status_json(error=str(error)))
        sys.exit(2)
    watchdog = _watchdog(device, clock, config.limits.stall)
    release = Release(device, clock, config.haptic_period, watchdog)
    # Of an end that not even `finally` sees.
    atexit.register(release)
    _without_collector()
    orphaned = False
    try:
        scheduling = f"{prefer_this_process(LOOP_PRIORITY)}, {lock_memory()}"
        # A simulated hand begins then.
        engaged = getattr(device, "engaged", None)
        loop = HapticLoop(config, memory, device, scheduling, watchdog, engaged)
        for signal in early:
            loop.interrupt(signal)
        loop.run()
        orphaned = loop.orphaned
        if orphaned:  # read by a network process that was stopped, and goes on after all
            memory.status.write(status_json(error=STOOD_STILL))
        if loop.interrupted:
            raise DeviceError(device.info.name, f"its loop was ended by {loop.interrupted}")
    except CohapticError as error:
        _let_go(release, loop)
        memory.status.write(status_json(error=str(error)))
        sys.exit(2)
    except Exception as error:
        # The hand first, then the report.
        _let_go(release, loop)
        memory.status.write(status_json(error=f"the haptic loop failed: {error!r}"))
        raise
    finally:
        _let_go(release, loop)
        if watchdog is not None:
            watchdog.stop()
        # Its maker removes the file, unless it was killed.
        memory.close(remove=orphaned)
        if orphaned and config.rest_mesh is not None:
            Path(config.rest_mesh).unlink(missing_ok=True)


def _opened(config: LoopConfig) -> Device:
    """The device; raises DeviceError when it cannot be had, or not as the settings ask."""
    device = open_device(config.device)
    if config.limits.dead_man and clutch_is_switch(config.device.choice, device.info):
        device.close()
        problem = "its clutch is the switch that the hand holds"
        raise DeviceError(device.info.name, problem, "choose another button, or --no-dead-man")
    return device


def _let_go(release: Release, loop: HapticLoop | None) -> None:
    """Let the device go from the force that the loop gave it last."""
    release(ZERO if loop is None else loop.written)


def _watchdog(device: Device, clock: SystemClock, limit: float) -> Watchdog | None:
    """A watchdog where the device offers what it needs, started."""
    if not isinstance(device, Releasable):
        return None
    watchdog = Watchdog(device, clock, limit)
    watchdog.start()
    return watchdog


def _without_collector() -> None:
    """The loop makes no cycles; a collection could cost several periods."""
    gc.collect()
    gc.freeze()
    gc.disable()
