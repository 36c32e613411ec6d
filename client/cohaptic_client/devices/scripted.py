"""A tip that a script moves: it follows the newest target of another process."""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import Final

from cohaptic.simulated.hand import Hand, HandState, ease, move
from cohaptic.vec import ZERO, Vec3, add, norm, scale, sub
from cohaptic_client.devices.device import DeviceInfo, DeviceSample
from cohaptic_client.devices.kind import DeviceChoice, DeviceConfig, DeviceKind

TARGET: Final = struct.Struct("<4d")  # x, y, z [m], and the time in which to get there [s]
# Nobody holds it, and no force moves it. Its limits are those of the simulated device, so that a
# script feels what `cohaptic touch` would.
INFO: Final = DeviceInfo(
    "scripted", max_force=10.0, max_stiffness=2000.0, damping=10.0, stall=1.0, held=False
)
# What the tip follows its target by: critically damped, 10 ms. A target that is set anew a hundred
# times a second becomes a smooth path, which is 20 ms behind. Reasoned, not measured.
_FOLLOWER: Final = Hand(mass=1.0, damping=200.0, stiffness=1e4)
# m/s; the safety layer takes the force away at 1.5 m/s, and a script is not to run into that by a
# target that is far away. The follower overshoots no path, so the goal's speed bounds the tip's.
MAX_SPEED: Final = 0.5
_EASE: Final = 1.5  # largest slope of `ease`
_SUBSTEP: Final = 0.001  # s; longest step of `move` that is stable
_MAX_CATCH_UP: Final = 0.1  # s of motion at most after a pause of the process
# Part of the body's radius by which the tip is outside of it before its first target.
_CLEARANCE: Final = 0.3


class ScriptedTip:
    """A tip that moves to the targets of a script and yields to no force.

    Args:
        start: Position before the first target [m].
    """

    def __init__(self, start: Vec3) -> None:
        self._state = HandState(start, ZERO)
        self._begin = self._end = self._goal = start
        self._since, self._duration = 0.0, 0.0
        self._now: float | None = None
        self._target: Callable[[], bytes | None] = lambda: None

    @property
    def info(self) -> DeviceInfo:
        """Abilities of the device."""
        return INFO

    def bind(self, target: Callable[[], bytes | None]) -> None:
        """Take targets from a function, which returns a `TARGET` if there is a new one."""
        self._target = target

    def read(self, now: float) -> DeviceSample:
        """Move the tip up to time `now` [s]; return its state."""
        if (raw := self._target()) is not None:
            x, y, z, duration = TARGET.unpack(raw)
            if self._now is None:  # where the script has it begin
                self._state = HandState((x, y, z), ZERO)
                self._goal = (x, y, z)
            self._set_out((x, y, z), duration, now)
        begun = now if self._now is None else max(self._now, now - _MAX_CATCH_UP)
        while begun < now - 1e-9:
            dt = min(now - begun, _SUBSTEP)
            begun += dt
            self._goal = self._goal_at(begun)
            self._state = move(self._state, _FOLLOWER, self._goal, ZERO, dt)
        self._now = now
        return DeviceSample(self._state.position, self._state.velocity)

    def write(self, force: Vec3) -> None:
        """Do nothing: no force moves this tip."""

    def close(self) -> None:
        """Do nothing: there is no hardware."""

    def _set_out(self, target: Vec3, duration: float, now: float) -> None:
        self._begin, self._end, self._since = self._goal, target, now
        way = norm(sub(target, self._goal))
        self._duration = max(duration, _EASE * way / MAX_SPEED)

    def _goal_at(self, now: float) -> Vec3:
        passed = now - self._since
        part = ease(passed / self._duration) if passed < self._duration else 1.0
        return add(self._begin, scale(sub(self._end, self._begin), part))


def start_beside(center: Vec3, radius: float) -> Vec3:
    """Return a point outside a body in the sphere of `radius` round `center`, to its right [m]."""
    return add(center, ((1.0 + _CLEARANCE) * radius, 0.0, 0.0))


def _info(choice: DeviceChoice) -> DeviceInfo:
    return INFO


def _open(config: DeviceConfig) -> ScriptedTip:
    return ScriptedTip(start_beside(config.center, config.radius))


SCRIPTED: Final = DeviceChoice("scripted")
KIND = DeviceKind("scripted", "a tip that a script moves", (), _info, _open)
