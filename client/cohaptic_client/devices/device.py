"""Interface of all devices. The next device is one file that fulfils this Protocol."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Protocol

from cohaptic.vec import Vec3


@dataclass(frozen=True, slots=True)
class DeviceInfo:
    """Abilities of a device.

    Args:
        name: For people.
        max_force: It can give; 0 for one that only senses [N].
        max_stiffness: It renders stably, from its maker or from measurements [N/m].
        damping: Physical damping of its tip, for Colgate's bound b > K T / 2 + |B| [N s/m].
        stall: A loop that stood still for longer lets the hand go; the tip of a real device may
            be deep inside an object by then [s].
    """

    name: str
    max_force: float
    max_stiffness: float
    damping: float = 0.0
    stall: float = 0.02


@dataclass(init=False)
class DeviceSample:
    """The tip of a device in the world frame.

    Args:
        position: [m].
        velocity: [m/s].
        level: Intention of a simulated hand, 0 to 1; 0 for a real one.
    """

    position: Final[Vec3]
    velocity: Final[Vec3]
    level: Final[float]

    def __init__(self, position: Vec3, velocity: Vec3, level: float = 0.0) -> None:
        self.position = position
        self.velocity = velocity
        self.level = level


class Device(Protocol):
    """A device as the loop uses it: read, then write, once per period, from one thread.

    `read` and `write` return within a fraction of a period; neither waits for the hardware longer.
    Both raise DeviceError when the device is gone, and the loop then ends with zero force.
    """

    @property
    def info(self) -> DeviceInfo:
        """Abilities of the device."""
        ...

    def read(self, now: float) -> DeviceSample:
        """The newest state of the tip; stale reports are skipped."""
        ...

    def write(self, force: Vec3) -> None:
        """Give `force` [N] to the hand until the next call."""
        ...

    def close(self) -> None:
        """Zero force, then release the hardware; may be called twice."""
        ...
