"""The life of the loop's process: open the device, run the loop, let go whatever happened.

It ends on command, on a signal, or when the network process is gone; the last force is always zero.

No signal ends the process with force on the hand. Ctrl-C reaches every process of a terminal, and
this one ends when its parent says so. Ctrl-Z would stop it in the middle of a contact, with the
last force on the hand for as long as the terminal likes: the loop runs on, and lets go when its
parent, which has stopped, is silent. Whatever else would end the process at once ends the loop
first. A terminal that closes is no end under `nohup`.

Whatever ends the loop, the hand is let go without a jerk, and the device is closed. An error of a
driver, an error of ours and a signal come in the middle of a contact: the force of that moment goes
along the same ramp as after a fault (`safety.FAULT_RELEASE_TIME`): to take 10 N away in a
millisecond is as much of a jolt as to give them.
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
from cohaptic_client.loop.config import LoopConfig
from cohaptic_client.loop.memory import LoopMemory
from cohaptic_client.loop.running.haptic_loop import ORPHANED_AFTER, HapticLoop, status_json
from cohaptic_client.loop.running.watchdog import Releasable, Watchdog
from cohaptic_client.loop.safety import FAULT_RELEASE_TIME, smooth

ZEROS: Final = 2  # times that zero is written: one report may be lost


class Release:
    """Lets a device go once, however often it is asked to.

    Args:
        device: To be let go and closed.
        clock: By which the ramp is timed.
        period: Between two writes [s].
        watchdog: That looks after each of these calls, too; None where the device offers none.
    """

    def __init__(
        self, device: Device, clock: Clock, period: float, watchdog: Watchdog | None = None
    ) -> None:
        self._device, self._clock, self._period = device, clock, period
        self._watchdog = watchdog
        self._done = False

    def __call__(self, force: Vec3 = ZERO) -> None:
        """Ramp down, zero force twice, close; whatever the device answers.

        Args:
            force: That it was given last [N].
        """
        if self._done:
            return
        self._done = True
        # A device that refuses a write gets its zeros at once.
        with contextlib.suppress(Exception):
            self._ramp(force)
        for _ in range(ZEROS):
            self._try(partial(self._device.write, ZERO))
        self._try(self._device.close)

    def _ramp(self, force: Vec3) -> None:
        """Give each force of the ramp at its time, however long the writes take."""
        clock = self._clock
        if force == ZERO or not is_finite(force):
            return
        end = clock.now() + FAULT_RELEASE_TIME
        while True:
            clock.sleep_until(min(end, clock.now() + self._period))
            left = (end - clock.now()) / FAULT_RELEASE_TIME
            # What the watchdog has taken away must not be given again.
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
# Those that a process may catch and whose default is to end it, but for the ones that an error of
# the process itself raises (segmentation faults), after which no handler of Python runs.
_ENDING: Final = (
    "SIGTERM", "SIGHUP", "SIGQUIT", "SIGALRM", "SIGVTALRM", "SIGPROF", "SIGUSR1", "SIGUSR2",
    "SIGXCPU", "SIGXFSZ", "SIGIO", "SIGPWR", "SIGSTKFLT", "SIGBREAK",
)  # fmt: skip


def handle_signals(end: Callable[[str], None]) -> None:
    """From now on `end` is called with the name of a signal that would end the process."""

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
    number = getattr(signal, name, None)  # systems differ in what they have
    if number is not None:
        signal.signal(number, handler)


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
