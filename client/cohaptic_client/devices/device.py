"""The interface of all devices. A new device is one file that fulfils this Protocol."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Protocol

from cohaptic.vec import Vec3


@dataclass(frozen=True, slots=True)
class DeviceInfo:
    """Abilities of a device, at its tip.

    Args:
        name: Name shown to users.
        max_force: Largest force that it can give for a short time; 0 if it has no motors [N].
        max_stiffness: Largest stiffness that it renders stably, as its maker states or as measured
            [N/m].
        damping: Physical damping b of its tip, for Colgate's bound b > K T / 2 + |B| in
            `loop.passivity` [N s/m].
        stall: Longest pause of the loop; after a longer one the force is released, because the tip
            of a real device may be deep inside an object by then [s].
        max_damping: Largest damping that it renders stably; 0 if not measured [N s/m].
        inertia: Apparent mass of its tip; 0 if not measured [kg].
        friction: Coulomb friction of its mechanics that the hand feels [N].
        resolution: Smallest change of position that its sensors can tell [m].
        latency: The device's part of the time from a motion of the tip to the answering force [s].
        rate: Highest rate at which it sends reports and takes forces [Hz].
        sensed_axes: Number of directions of translation that it senses, 1 to 3.
        force_axes: Number of directions of translation along which it gives force, 0 to 3.
        switch: Whether it has a button that the hand can hold together with the device.
        lets_go: Time without a new force after which its driver or board drops the last force by
            itself; inf if the last force stays on the hand [s].
        held: Whether a person holds it, whom a force can hurt and who can acknowledge a fault.
    """

    name: str
    max_force: float
    max_stiffness: float
    damping: float = 0.0
    stall: float = 0.02
    max_damping: float = 0.0
    inertia: float = 0.0
    friction: float = 0.0
    resolution: float = 0.0
    latency: float = 0.0
    rate: float = 1000.0
    sensed_axes: int = 3
    force_axes: int = 3
    switch: bool = False
    lets_go: float = math.inf
    held: bool = True


@dataclass(init=False)
class DeviceSample:
    """State of a device's tip at one time, in the world frame.

    Args:
        position: Position of the tip [m].
        velocity: Velocity of the tip [m/s].
        level: Level of a simulated hand's intention, from 0 (off the surface) to 1 (pressed); 0 for
            a real hand.
        buttons: One bit for each pressed button; bit 0 is the switch of `DeviceInfo.switch`.
        fresh: False while the hardware is silent: position and velocity are then old, and written
            forces do not reach the hand.
    """

    position: Final[Vec3]
    velocity: Final[Vec3]
    level: Final[float]
    buttons: Final[int]
    fresh: Final[bool]

    def __init__(
        self,
        position: Vec3,
        velocity: Vec3,
        level: float = 0.0,
        buttons: int = 0,
        fresh: bool = True,
    ) -> None:
        self.position = position
        self.velocity = velocity
        self.level = level
        self.buttons = buttons
        self.fresh = fresh


class Device(Protocol):
    """A device as the loop uses it: read, then write, once per period, from one thread.

    `read` and `write` return within a fraction of a period and never wait longer for the hardware.
    Both raise DeviceError when the device is gone, and the loop then ends with zero force.
    """

    @property
    def info(self) -> DeviceInfo:
        """Abilities of the device."""
        ...

    def read(self, now: float) -> DeviceSample:
        """Return the newest state of the tip at time `now` [s]; older reports are skipped."""
        ...

    def write(self, force: Vec3) -> None:
        """Give `force` [N] to the hand until the next call of this method."""
        ...

    def close(self) -> None:
        """Write zero force, then release the hardware; may be called twice."""
        ...
