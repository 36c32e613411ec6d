"""A device in the world: its own frame on one side, the frame of the body on the other.

The clutch: while its button is held, the tip stands still in the world and the hand moves on, as
one lifts a mouse from its pad. It takes hold only while the hand feels no force, and none is given
until it is released: a hand that moves under a constant force could take any energy out of it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Protocol

from cohaptic.vec import ZERO, Vec3, scale
from cohaptic_client.devices.device import DeviceInfo, DeviceSample
from cohaptic_client.devices.placing.workspace import Workspace, seen_from_world

# From no force to all of it after the clutch, or after a device or a loop that was silent.
RETURN_TIME = 0.5  # s at least
# N/s; as fast as the safety layer lets a force change that no motion of the hand causes
_RETURN_RATE = 20.0
LOSS_TIME = 0.02  # s from all to none once the device is silent: that of a fault
# s by which a period is counted as too long before the device lets go: a driver counts from write
# to write, and this from read to read.
_SOONER = 0.001
# s without force after a period in which the device let go: the loop's own ramp from the force of
# before, which takes half of it, is for a hand that has none any more.
AFTER_LOSS = 2.0 * LOSS_TIME
_LONGEST_STEP = 0.002  # s that count of a late period while a force goes: two of the slower loops


def return_time(max_force: float) -> float:
    """Time from no force to all of it, for a device with this largest force [N], in s."""
    return max(RETURN_TIME, max_force / _RETURN_RATE)


class RawDevice(Protocol):
    """A device in its own frame, whose axes point right, away from the user and up.

    The duties are those of `device.Device`; `release` may be called from another thread.
    """

    @property
    def info(self) -> DeviceInfo:
        """Abilities of the device."""
        ...

    def read(self, now: float) -> DeviceSample:
        """The newest state of the tip, in the device's frame."""
        ...

    def write(self, force: Vec3) -> None:
        """Give `force` [N] to the hand, in the device's frame."""
        ...

    def release(self) -> None:
        """Take the force off the hand without waiting for a call that is under way."""
        ...

    def close(self) -> None:
        """Zero force, then release the hardware; may be called twice."""
        ...


class Placed:
    """A device whose workspace lies in the world.

    Args:
        raw: In its own frame.
        workspace: Workspace of the device.
        recentre: Whether the first point of the tip is put on the workspace's centre.
        clutch: Bit of `DeviceSample.buttons` that holds the tip; 0 for none.
    """

    def __init__(
        self, raw: RawDevice, workspace: Workspace, *, recentre: bool = False, clutch: int = 0
    ) -> None:
        self._raw = raw
        self._workspace = workspace
        self._recentre = recentre
        self._clutch = clutch
        self._info = seen_from_world(raw.info, workspace.scale)
        self._held: Vec3 | None = None  # where the tip stands in the world under the clutch
        self._gain = 1.0
        self._wait = 0.0  # until the force comes back [s]
        self._now: float | None = None  # of the last reading
        self._return_time = return_time(raw.info.max_force)
        self._longest = raw.info.lets_go - _SOONER  # period after which the hand has no force [s]
        self._force = ZERO

    @property
    def info(self) -> DeviceInfo:
        """Abilities of the device, in the units of the world."""
        return self._info

    @property
    def workspace(self) -> Workspace:
        """How the device's frame lies in the world now."""
        return self._workspace

    def read(self, now: float) -> DeviceSample:
        """The newest state of the tip in the world.

        Raises:
            DeviceError: The device is gone.
        """
        sample = self._raw.read(now)
        position = sample.position
        if self._recentre:
            self._recentre = False
            self._workspace = replace(self._workspace, origin=position)
        if self._clutch:
            self._use_clutch(bool(sample.buttons & self._clutch), position)
        self._gain_at(now, silent=not sample.fresh)
        if self._held is not None:
            return DeviceSample(self._held, ZERO, sample.level, sample.buttons, sample.fresh)
        where, w = self._workspace, sample.velocity
        return DeviceSample(
            where.position(position), where.velocity(w), sample.level, sample.buttons, sample.fresh
        )

    def write(self, force: Vec3) -> None:
        """Give `force` [N], in the world's axes, to the hand."""
        self._force = force
        given = self._workspace.force(force)
        self._raw.write(given if self._gain == 1.0 else scale(given, self._gain))

    def release(self) -> None:
        """Take the force off the hand; for another thread."""
        self._raw.release()

    def close(self) -> None:
        """Zero force, then release the hardware; may be called twice."""
        self._raw.close()

    def _use_clutch(self, pressed: bool, position: Vec3) -> None:
        if self._held is not None and not pressed:
            self._workspace = self._workspace.holding(position, self._held)
            self._held = None
        elif self._held is None and pressed and self._force == ZERO:
            self._held = self._workspace.position(position)

    def _gain_at(self, now: float, *, silent: bool) -> None:
        """Share of the force that is given: it goes and comes without a jerk."""
        passed = 0.0 if self._now is None else max(0.0, now - self._now)
        self._now = now
        # The clutch takes hold without force; and after too long a period there is none any more.
        if passed > self._longest:
            self._gain, self._wait = 0.0, AFTER_LOSS
        elif self._held is not None:
            self._gain = 0.0
        elif silent:
            self._gain = max(0.0, self._gain - min(passed, _LONGEST_STEP) / LOSS_TIME)
        elif self._wait > 0.0:
            self._wait -= min(passed, _LONGEST_STEP)
        elif self._gain < 1.0:
            self._gain = min(1.0, self._gain + passed / self._return_time)
