"""The life of the loop's process: open the device, run the loop, release the hand in any case.

The process ends on command, on a signal, or when the network process is gone; the last force is
always zero.

No signal ends the process with force on the hand. Ctrl-C reaches every process of a terminal; this
process ignores it and ends when its parent says so. Ctrl-Z would stop the process in contact, with
the last force on the hand until it is resumed. The process ignores Ctrl-Z, too, runs on, and lets
the hand go because its stopped parent is silent. Any other signal that would end the process ends
the loop first. Under `nohup` the closing of the terminal does not end the process.

Whatever ends the loop, the force falls without a jerk, and the device is closed. Errors of a
driver, errors of this program and signals may come while the hand is in contact: the force of that
moment then follows the same ramp as after a fault (`safety.FAULT_RELEASE_TIME`), because taking
10 N away in a millisecond jolts the hand as much as applying them.
"""

from __future__ import annotations

import atexit
import contextlib
import gc
import signal
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Final

from cohaptic.clock import Clock, SystemClock
from cohaptic.errors import CohapticError, DeviceError
from cohaptic.runtime.scheduling import LOOP_PRIORITY, lock_memory, prefer_this_process
from cohaptic.vec import ZERO, Vec3, is_finite, scale
from cohaptic_client.devices.catalogue import open_device
from cohaptic_client.devices.device import Device
from cohaptic_client.devices.placing.options import clutch_is_switch
from cohaptic_client.devices.scripted import ScriptedTip
from cohaptic_client.loop.added import RuleChoice
from cohaptic_client.loop.config import LoopConfig
from cohaptic_client.loop.memory import LoopMemory
from cohaptic_client.loop.passed import Luggage, unpack
from cohaptic_client.loop.running.haptic_loop import ORPHANED_AFTER, HapticLoop, status_json
from cohaptic_client.loop.running.watchdog import Releasable, Watchdog
from cohaptic_client.loop.safety import FAULT_RELEASE_TIME, smooth

ZEROS: Final = 2  # number of writes of zero force, because one report may be lost


class Release:
    """Takes the force off the hand and closes the device at the first call; then does nothing.

    Args:
        clock: Clock that times the ramp.
        period: Time between two writes [s].
        watchdog: Watchdog of the loop, which watches the calls of the device here, too; None if
            there is none.
    """

    def __init__(
        self, device: Device, clock: Clock, period: float, watchdog: Watchdog | None = None
    ) -> None:
        self._device, self._clock, self._period = device, clock, period
        self._watchdog = watchdog
        self._done = False

    def __call__(self, force: Vec3 = ZERO) -> None:
        """Ramp the force down, write zero force twice, close the device; ignore its errors.

        Args:
            force: Last force that the device was given [N].
        """
        if self._done:
            return
        self._done = True
        # If the device refuses a write, the ramp ends and the zeros follow at once.
        with contextlib.suppress(Exception):
            self._ramp(force)
        for _ in range(ZEROS):
            self._try(partial(self._device.write, ZERO))
        self._try(self._device.close)

    def _ramp(self, force: Vec3) -> None:
        """Write the falling forces of the ramp, each computed for the time of its write."""
        clock = self._clock
        if force == ZERO or not is_finite(force):
            return
        end = clock.now() + FAULT_RELEASE_TIME
        while True:
            clock.sleep_until(min(end, clock.now() + self._period))
            left = (end - clock.now()) / FAULT_RELEASE_TIME
            # The force that the watchdog has taken away must not be given again.
            if left <= 0.0 or (self._watchdog is not None and self._watchdog.fired):
                return
            self._watched(partial(self._device.write, scale(force, smooth(left))))

    def _try(self, call: Callable[[], None]) -> None:
        with contextlib.suppress(Exception):
            self._watched(call)

    def _watched(self, call: Callable[[], None]) -> None:
        if self._watchdog is not None:
            self._watchdog.begin()
        try:
            call()
        finally:
            if self._watchdog is not None:
                self._watchdog.end()


_IGNORED: Final = ("SIGINT", "SIGTSTP", "SIGTTIN", "SIGTTOU", "SIGPIPE")
# All signals that a process can catch and that end it by default, except those that an error of the
# process itself raises (segmentation faults): no Python handler runs after these.
_ENDING: Final = (
    "SIGTERM", "SIGHUP", "SIGQUIT", "SIGALRM", "SIGVTALRM", "SIGPROF", "SIGUSR1", "SIGUSR2",
    "SIGXCPU", "SIGXFSZ", "SIGIO", "SIGPWR", "SIGSTKFLT", "SIGBREAK",
)  # fmt: skip


def handle_signals(end: Callable[[str], None]) -> None:
    """Ignore the signals in `_IGNORED`; call `end` with the name of each signal in `_ENDING`."""

    def ended(number: int, _frame: object) -> None:
        end(signal.Signals(number).name)

    for name in _IGNORED:
        _set(name, signal.SIG_IGN)
    for name in _ENDING:
        if not (name == "SIGHUP" and _under_nohup()):
            _set(name, ended)


def _under_nohup() -> bool:
    number = getattr(signal, "SIGHUP", None)
    return number is not None and signal.getsignal(number) == signal.SIG_IGN


def _set(name: str, handler: Callable[[int, object], None] | signal.Handlers) -> None:
    number = getattr(signal, name, None)  # systems differ in the signals that they have
    if number is not None:
        signal.signal(number, handler)


STOOD_STILL: Final = (
    f"its loop heard nothing of this program for {ORPHANED_AFTER:g} s, as when that is stopped or "
    "the machine is too busy, and has let the hand go; start again"
)


def live(text: str) -> None:
    """Open the device, run the loop to its end, and release the device.

    Args:
        text: Configuration that `LoopConfig.to_json` wrote.
    """
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
        device, rules = _opened(config, memory)
    except CohapticError as error:
        memory.status.write(status_json(error=str(error)))
        sys.exit(2)
    watchdog = _watchdog(device, clock, config.limits.stall)
    release = Release(device, clock, config.haptic_period, watchdog)
    # For an end of the process without the `finally` below.
    atexit.register(release)
    _without_collector()
    orphaned = False
    try:
        scheduling = f"{prefer_this_process(LOOP_PRIORITY)}, {lock_memory()}"
        # A simulated hand begins to move once it is engaged.
        engaged = getattr(device, "engaged", None)
        loop = HapticLoop(config, memory, device, scheduling, watchdog, engaged, rules)
        for signal in early:
            loop.interrupt(signal)
        loop.run()
        orphaned = loop.orphaned
        if orphaned:  # for a network process that was only stopped, and goes on later
            memory.status.write(status_json(error=STOOD_STILL))
        if loop.interrupted:
            raise DeviceError(device.info.name, f"its loop was ended by {loop.interrupted}")
    except CohapticError as error:
        _let_go(release, loop)
        memory.status.write(status_json(error=str(error)))
        sys.exit(2)
    except Exception as error:
        # Release the hand first, then report.
        _let_go(release, loop)
        memory.status.write(status_json(error=f"the haptic loop failed: {error!r}"))
        raise
    finally:
        _let_go(release, loop)
        if watchdog is not None:
            watchdog.stop()
        # The network process removes its files, unless it was killed.
        memory.close(remove=orphaned)
        if orphaned and config.rest_mesh is not None:
            Path(config.rest_mesh).unlink(missing_ok=True)


def _opened(config: LoopConfig, memory: LoopMemory) -> tuple[Device, list[RuleChoice]]:
    """Open the device; return it with the rules of other packages and of a script.

    Raises:
        DeviceError: It cannot be opened, or its clutch is also the switch.
    """
    luggage = Luggage(None, ())
    if config.passed:
        luggage = unpack(sys.stdin.buffer.read(), config.device.choice)
    device = luggage.device or open_device(config.device)
    if config.limits.dead_man and clutch_is_switch(config.device.choice, device.info):
        device.close()
        problem = "its clutch is the switch that the hand holds"
        raise DeviceError(device.info.name, problem, "choose another button, or --no-dead-man")
    if isinstance(device, ScriptedTip):
        device.bind(memory.target.read)
    passed = iter(luggage.rules)
    return device, [name or next(passed) for name in config.rules]


def _let_go(release: Release, loop: HapticLoop | None) -> None:
    """Release the device, on a ramp from the last force that the loop gave it."""
    release(ZERO if loop is None else loop.written)


def _watchdog(device: Device, clock: SystemClock, limit: float) -> Watchdog | None:
    """Return a started watchdog; None if another thread cannot release the device."""
    if not isinstance(device, Releasable):
        return None
    watchdog = Watchdog(device, clock, limit)
    watchdog.start()
    return watchdog


def _without_collector() -> None:
    """Switch garbage collection off: the loop makes no cycles, and a collection takes too long."""
    gc.collect()
    gc.freeze()
    gc.disable()
