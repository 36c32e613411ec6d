"""A device placed in the world: maps positions and forces between its own frame and the world's.

While the clutch's button is pressed, the tip stands still in the world and the hand moves on, as
when a mouse is lifted from its pad. The clutch engages only while the hand feels no force, and the
hand gets no force until the button is released: moving on under a constant force, the hand could
gain unlimited energy.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Protocol

from cohaptic.vec import ZERO, Vec3, scale
from cohaptic_client.devices.device import DeviceInfo, DeviceSample
from cohaptic_client.devices.placing.workspace import Workspace, seen_from_world

# s; least time from no force to full force after a use of the clutch, or a silent device or loop
RETURN_TIME = 0.5
# N/s; rate at which the safety layer lets a force change that no motion of the hand causes
_RETURN_RATE = 20.0
LOSS_TIME = 0.02  # s from full to no force once the device is silent, as after a fault
# s; margin before `lets_go` from which a period counts as too long: a driver measures from write to
# write, and this class from read to read
_SOONER = 0.001
# s without force after a period so long that the device took the force away by itself. The loop's
# own release takes half of this time, and starts from the force that the hand has already lost.
AFTER_LOSS = 2.0 * LOSS_TIME
_LONGEST_STEP = 0.002  # s; a late period counts as at most this while the force falls


def return_time(max_force: float) -> float:
    """Return the time in which the force rises from zero to full after a clutch or a silence [s].

    Args:
        max_force: Largest force of the device [N].
    """
    return max(RETURN_TIME, max_force / _RETURN_RATE)


class RawDevice(Protocol):
    """A device in its own frame; the axes of that frame point right, away from the user and up.

    Its methods behave as those of `device.Device`; `release` may be called from another thread.
    """

    @property
    def info(self) -> DeviceInfo:
        """Abilities of the device."""
        ...

    def read(self, now: float) -> DeviceSample:
        """Return the newest state of the tip at time `now` [s], in the device's frame."""
        ...

    def write(self, force: Vec3) -> None:
        """Give `force` [N] to the hand, in the device's frame."""
        ...

    def release(self) -> None:
        """Take the force off the hand without waiting for a call that has not yet returned."""
        ...

    def close(self) -> None:
        """Write zero force, then release the hardware; may be called twice."""
        ...


class Placed:
    """A device whose workspace is placed in the world, with centring and clutch.

    Args:
        raw: Device in its own frame.
        recentre: Whether the tip's first position is put on the workspace's centre.
        clutch: Bit of the clutch's button in `DeviceSample.buttons`; 0 without a clutch.
    """

    def __init__(
        self, raw: RawDevice, workspace: Workspace, *, recentre: bool = False, clutch: int = 0
    ) -> None:
        self._raw = raw
        self._workspace = workspace
        self._recentre = recentre
        self._clutch = clutch
        self._info = seen_from_world(raw.info, workspace.scale)
        self._held: Vec3 | None = None  # tip in the world while the clutch keeps it still
        self._gain = 1.0
        self._wait = 0.0  # time until the force comes back [s]
        self._now: float | None = None  # time of the last reading [s]
        self._return_time = return_time(raw.info.max_force)
        self._longest = raw.info.lets_go - _SOONER  # period after which the hand has no force [s]
        self._force = ZERO

    @property
    def info(self) -> DeviceInfo:
        """Abilities of the device, in the units of the world."""
        return self._info

    @property
    def workspace(self) -> Workspace:
        """Present map between the device's frame and the world."""
        return self._workspace

    def read(self, now: float) -> DeviceSample:
        """Return the newest state of the tip in the world at time `now` [s].

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
        """Give `force` [N], in the world's frame, to the hand."""
        self._force = force
        given = self._workspace.force(force)
        self._raw.write(given if self._gain == 1.0 else scale(given, self._gain))

    def release(self) -> None:
        """Take the force off the hand; may be called from another thread."""
        self._raw.release()

    def close(self) -> None:
        """Write zero force, then release the hardware; may be called twice."""
        self._raw.close()

    def _use_clutch(self, pressed: bool, position: Vec3) -> None:
        if self._held is not None and not pressed:
            self._workspace = self._workspace.holding(position, self._held)
            self._held = None
        elif self._held is None and pressed and self._force == ZERO:
            self._held = self._workspace.position(position)

    def _gain_at(self, now: float, *, silent: bool) -> None:
        """Update the fraction of the force that the hand gets, without a jerk of the force."""
        passed = 0.0 if self._now is None else max(0.0, now - self._now)
        self._now = now
        # Both steps to 0 are smooth for the hand: after too long a period the device has let go
        # already, and the clutch engages only without force.
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
