"""The end of a loop, whatever ended it: the hand is let go without a jerk, and the device closed.

An error of a driver, an error of ours and a signal come in the middle of a contact. The force of
that moment goes along the same ramp as after a fault (`safety.FAULT_RELEASE_TIME`): to take 10 N
away in a millisecond is as much of a jolt as to give them.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from functools import partial
from typing import Final

from cohaptic.clock import Clock
from cohaptic.vec import ZERO, Vec3, is_finite, scale
from cohaptic_client.devices.device import Device
from cohaptic_client.loop.running.watchdog import Watchdog
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
