"""A knock that tells which of two devices is which."""

from __future__ import annotations

import math

from cohaptic.clock import Clock
from cohaptic.errors import DeviceError
from cohaptic.vec import ZERO, Vec3
from cohaptic_client.devices.device import Device

# N; felt at once by a hand on the device (a fingertip notices 0.05 N), and too little to move one
# that nobody holds by more than its friction lets go of.
STRENGTH = 0.5
KNOCKS = 3
LENGTH = 0.12  # s of a knock; half a sine, so that it rises by no more than 13 N/s
_REST = 0.2  # s between two of them
_PERIOD = 0.001  # s


def pulse_force(t: float) -> Vec3:
    """Force at `t` [s] after the start: a few gentle pushes upward, each one half a sine [N]."""
    number, within = divmod(t, LENGTH + _REST)
    if t < 0.0 or number >= KNOCKS or within >= LENGTH:
        return ZERO
    return (0.0, 0.0, STRENGTH * math.sin(math.pi * within / LENGTH))


def pulse(device: Device, clock: Clock) -> None:
    """Knock on the hand, then close the device.

    Raises:
        DeviceError: The device gives no force, or is gone.
    """
    try:
        if device.info.max_force == 0.0:
            raise DeviceError(device.info.name, "it only senses, so that it cannot knock")
        start = clock.now()
        while (t := clock.now() - start) < KNOCKS * (LENGTH + _REST):
            device.read(clock.now())
            device.write(pulse_force(t))
            clock.sleep_until(clock.now() + _PERIOD)
        device.write(ZERO)
    finally:
        device.close()
