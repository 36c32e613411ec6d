"""The end of a loop, whatever ended it: the hand is let go without a jerk, and the device closed.

An error of a driver, an error of ours and a signal come in the middle of a contact. The force of
that moment goes along the same ramp as after a fault (`safety.FAULT_RELEASE_TIME`): to take 10 N
away in a millisecond is as much of a jolt as to give them.
"""

from __future__ import annotations

import contextlib
import math
from typing import Final

from cohaptic.clock import Clock
from cohaptic.vec import ZERO, Vec3, is_finite, scale
from cohaptic_client.devices.device import Device
from cohaptic_client.loop.safety import FAULT_RELEASE_TIME, smooth

# A device whose writes are so slow that the ramp would take longer than this gets zero at once.
LONGEST_RELEASE: Final = 5.0 * FAULT_RELEASE_TIME  # s
ZEROS: Final = 2  # times that zero is written: one report may be lost


class Release:
    """Lets a device go once, however often it is asked to.

    Args:
        device: To be let go and closed.
        clock: By which the ramp is timed.
        period: Between two writes [s].
    """

    def __init__(self, device: Device, clock: Clock, period: float) -> None:
        self._device, self._clock, self._period = device, clock, period
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
            with contextlib.suppress(Exception):
                self._device.write(ZERO)
        with contextlib.suppress(Exception):
            self._device.close()

    def _ramp(self, force: Vec3) -> None:
        if force == ZERO or not is_finite(force):
            return
        clock, start = self._clock, self._clock.now()
        steps = math.ceil(FAULT_RELEASE_TIME / self._period)
        for k in range(1, steps):
            clock.sleep_until(start + k * self._period)
            if clock.now() > start + LONGEST_RELEASE:
                return
            self._device.write(scale(force, smooth(1.0 - k / steps)))
        clock.sleep_until(start + steps * self._period)
