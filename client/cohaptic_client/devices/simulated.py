"""A device with a simulated hand, for the same loop and safety layer as a real device."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import replace
from typing import Final

from cohaptic.simulated.hand import Hand, HandState, Intention, move
from cohaptic.vec import ZERO, Vec3, norm, scale, sub
from cohaptic_client.devices.device import DeviceInfo, DeviceSample

_SUBSTEP: Final = 0.001  # s; longest step for which `move` is stable
# s; after a longer stall of the process the hand goes on from its last position
_MAX_CATCH_UP: Final = 0.1
# s; time constant with which a driver derives a velocity from the steps of its sensors
_VELOCITY_FILTER: Final = 0.005
_LONGEST_LATENCY: Final = 64  # most reports on their way: 16 ms of a device that is read at 4 kHz
# The stall is long, because a simulated hand stops with a process that stalls, and hurts nobody.
# The rig in virtual air is well damped, so that the laws are tested and not the device.
INFO = DeviceInfo("simulated", max_force=10.0, max_stiffness=2000.0, damping=10.0, stall=1.0)


class SimulatedDevice:
    """A hand that follows an intention and feels the force that the loop writes.

    The damping of `INFO` is only declared; the hand's own damping acts in its place. With a preset,
    the mechanics include its damping, mass, friction, resolution, latency and largest force.

    Args:
        hand: Mechanics of the hand.
        intention: Intention of the hand. Its time starts at the first `read`; if `waits` is True,
            it starts when the hand is engaged.
        waits: Whether the hand stays where it is until it is engaged.
    """

    def __init__(
        self, hand: Hand, intention: Intention, info: DeviceInfo = INFO, *, waits: bool = False
    ) -> None:
        self._info = info
        self._modelled = info.inertia > 0.0
        if self._modelled:
            mass, damping = hand.mass + info.inertia, hand.damping + info.damping
            hand = replace(hand, mass=mass, damping=damping)
        self._hand = hand
        self._intention = intention
        self._waits = waits
        self._state = HandState(intention.at(0.0), ZERO)
        self._force = ZERO
        self._start: float | None = None
        self._now = 0.0
        self._reports = deque[tuple[float, Vec3]](maxlen=_LONGEST_LATENCY)
        self._seen = self._state.position
        self._velocity = ZERO

    @property
    def info(self) -> DeviceInfo:
        """Abilities of the device."""
        return self._info

    def read(self, now: float) -> DeviceSample:
        """State of the tip after the hand has moved up to `now` under the force written last."""
        if self._start is None:
            self._start, self._now = math.inf if self._waits else now, now
        passed = now - self._now
        remaining = min(passed, _MAX_CATCH_UP)
        while remaining > 1e-9:
            dt = min(remaining, _SUBSTEP)
            target = self._intention.at(now - remaining + dt - self._start)
            self._move(target, dt)
            remaining -= dt
        self._now = now
        level = self._intention.level(now - self._start)
        if not self._modelled:
            return DeviceSample(self._state.position, self._state.velocity, level)
        self._sense(now, passed)
        return DeviceSample(self._seen, self._velocity, level)

    def engaged(self, now: float) -> None:
        """Start the intention of a waiting hand: it can feel a force from `now` on [s]."""
        if self._start == math.inf:
            self._start = now

    def write(self, force: Vec3) -> None:
        """Give `force` [N] to the hand until the next call."""
        size = norm(force)
        if self._modelled and size > self._info.max_force:
            force = scale(force, self._info.max_force / size)
        self._force = force

    def close(self) -> None:
        """Let the hand go."""
        self._force = ZERO

    def _move(self, target: Vec3, dt: float) -> None:
        """Move hand and mechanics for `dt`; the mechanics' friction brakes or stops the motion."""
        before = self._state
        self._state = move(before, self._hand, target, self._force, dt)
        if self._info.friction <= 0.0:
            return
        velocity = self._state.velocity
        speed, taken = norm(velocity), self._info.friction * dt / self._hand.mass
        velocity = scale(velocity, 1.0 - taken / speed) if speed > taken else ZERO
        x, v = before.position, velocity
        place = (x[0] + dt * v[0], x[1] + dt * v[1], x[2] + dt * v[2])
        self._state = HandState(place, velocity)

    def _sense(self, now: float, passed: float) -> None:
        """Update the sensed position and velocity: quantised by the sensors, late by `latency`."""
        x, step = self._state.position, self._info.resolution
        if step > 0.0:
            x = (step * round(x[0] / step), step * round(x[1] / step), step * round(x[2] / step))
        self._reports.append((now, x))
        while len(self._reports) > 1 and self._reports[1][0] <= now - self._info.latency + 1e-9:
            self._reports.popleft()
        if passed > 0.0:
            share = passed / (passed + _VELOCITY_FILTER)
            way = scale(sub(self._reports[0][1], self._seen), 1.0 / passed)
            v = self._velocity
            self._velocity = (
                v[0] + share * (way[0] - v[0]),
                v[1] + share * (way[1] - v[1]),
                v[2] + share * (way[2] - v[2]),
            )
        self._seen = self._reports[0][1]
