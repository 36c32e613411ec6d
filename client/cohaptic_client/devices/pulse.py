"""Knocks that show which device is which, and whether each pushes in the right direction."""

from __future__ import annotations

import math

from cohaptic.clock import Clock
from cohaptic.errors import DeviceError
from cohaptic.runtime.signals_put_off import signals_put_off
from cohaptic.vec import ZERO, Vec3, dot, scale, sub
from cohaptic_client.devices.device import Device

# N; a hand on the device feels it at once (a fingertip notices 0.05 N), but it hardly moves a
# device that nobody holds against the friction of its mechanics.
STRENGTH = 0.5
KNOCKS = 3
LENGTH = 0.12  # s of a knock; half a sine, so that the force rises by at most about 13 N/s
_REST = 0.2  # s between two knocks
_PERIOD = 0.001  # s
_UP: Vec3 = (0.0, 0.0, 1.0)
# m; least way that counts: a hand of 400 N/m yields by 1 mm, and a resting hand wanders by less
CLEAR = 0.0003


def pulse_force(t: float, direction: Vec3 = _UP, strength: float = STRENGTH) -> Vec3:
    """Force at `t` in a series of gentle pushes, each of them half a sine [N].

    Args:
        t: Time since the start [s].
        direction: Direction of the pushes; a unit vector.
        strength: Peak force of each push [N].
    """
    number, within = divmod(t, LENGTH + _REST)
    if t < 0.0 or number >= KNOCKS or within >= LENGTH:
        return ZERO
    return scale(direction, strength * math.sin(math.pi * within / LENGTH))


def pulse(device: Device, clock: Clock, direction: Vec3 = _UP) -> list[float]:
    """Knock on the hand, then close the device.

    Args:
        device: Open device, which is closed in any case.
        direction: Direction of the pushes; a unit vector.

    Returns:
        Way of the tip along the direction in each knock, as a mean weighted by the force [m]. A
        device that pushes in the right direction has positive ways, however it is held.

    Raises:
        DeviceError: The device gives no force, or is gone.
    """
    try:
        with signals_put_off() as ended:
            if device.info.max_force == 0.0:
                raise DeviceError(device.info.name, "it only senses, so that it cannot knock")
            strength = min(STRENGTH, device.info.max_force)
            ways, pushes = [0.0] * KNOCKS, [0.0] * KNOCKS
            start, before, last = clock.now(), ZERO, -1
            while (t := clock.now() - start) < KNOCKS * (LENGTH + _REST) and not ended():
                place = device.read(clock.now()).position
                number = min(KNOCKS - 1, int(t / (LENGTH + _REST)))
                if number != last:
                    before, last = place, number
                force = pulse_force(t, direction, strength)
                push = dot(force, direction)
                ways[number] += push * dot(sub(place, before), direction)
                pushes[number] += push
                device.write(force)
                clock.sleep_until(clock.now() + _PERIOD)
            device.write(ZERO)
            return [
                way / push if push > 0.0 else 0.0 for way, push in zip(ways, pushes, strict=True)
            ]
    finally:
        device.close()


def verdict(name: str, ways: list[float]) -> str:
    """Sentence on whether a device pushes in the right direction, from the tip's ways [m].

    Raises:
        DeviceError: The tip moved against every knock: an object would pull it in.
    """
    largest = 1e3 * max(ways, key=abs)
    if all(way < -CLEAR for way in ways):
        raise DeviceError(
            name,
            f"it moved against each of its knocks, by {-largest:.1f} mm; an object would pull it",
            "hold it loosely and try again; if it does so again, turn round the direction of its "
            "motor in the file of the unit, and touch nothing with it before",
        )
    if all(way > CLEAR for way in ways):
        return f"it moved with each of its knocks, by {largest:.1f} mm: it pushes where it should"
    return "it moved too little to tell whether it pushes where it should; hold it loosely for that"
