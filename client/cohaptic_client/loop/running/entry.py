"""The life of the loop's process: open the device, run the loop, let go whatever happened.

It ends on command, or when the network process is gone; the last force is always zero.
"""

from __future__ import annotations

import contextlib
import gc
import signal
import sys
from pathlib import Path

from cohaptic.errors import CohapticError
from cohaptic.runtime.scheduling import LOOP_PRIORITY, prefer_this_process
from cohaptic.vec import ZERO
from cohaptic_client.devices.catalogue import open_device
from cohaptic_client.devices.device import Device
from cohaptic_client.loop.config import LoopConfig
from cohaptic_client.loop.memory import LoopMemory
from cohaptic_client.loop.running.haptic_loop import HapticLoop, status_json


def live(text: str) -> None:
    """Run the loop of a configuration, as `LoopConfig.to_json` wrote it, to its end."""
    # Ctrl-C reaches every process of a terminal; this one ends when its parent says so.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    config = LoopConfig.from_json(text)
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
        loop = HapticLoop(config, memory, device, prefer_this_process(LOOP_PRIORITY))
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
