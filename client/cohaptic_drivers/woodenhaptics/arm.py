"""An arm of this family as a device in its own frame, for any of its boards."""

from __future__ import annotations

from typing import Protocol

from cohaptic.errors import DeviceError
from cohaptic.vec import ZERO, Vec3, add, is_finite, lerp, norm, scale, sub
from cohaptic_client.devices.device import DeviceInfo, DeviceSample
from cohaptic_drivers.woodenhaptics.kinematics import (
    Pose,
    joint_angles,
    motor_currents,
    pose_at,
    resolution,
)
from cohaptic_drivers.woodenhaptics.reports import Reported
from cohaptic_drivers.woodenhaptics.unit import Unit

NAME = "woodenhaptics"
SILENCE = 0.02  # s; after a longer silence of the board its last counts are out of date
GIVE_UP = 0.25  # s; after a longer silence the board counts as gone
SERIAL_LETS_GO = 0.1  # s; silence of the host after which the serial board switches its motors off
# s; one count is 0.06 mm, or 60 mm/s in a period of 1 ms; the filter leaves a fifth of that.
_FILTER = 0.004
# m between two reports; at 1 kHz that is 30 m/s, faster than a hand: counters were zeroed, or the
# report is garbage.
_JUMP = 0.03
_FASTEST = 1.5  # m/s; speed of the hand that is allowed besides `_JUMP`, after a longer silence


class Link(Protocol):
    """Connection to a board; none of its calls waits for the board."""

    def poll(self, now: float) -> Reported | None:
        """Return the newest report since the last call; raise DeviceError if the board is gone."""
        ...

    def send(self, milliamps: Vec3) -> None:
        """Send these motor currents [mA]; raise as `poll`."""
        ...

    def release(self) -> None:
        """Set the currents to zero at once; may be called from another thread."""
        ...

    def close(self) -> None:
        """Set the currents to zero, then release the board."""
        ...


class WoodenArm:
    """An arm in its own frame: right, away from the user, up.

    Args:
        link: Connection to its board; this object closes it.
        first: First report of the board.
        force: Whether the motors are used.
        home_here: Whether the arm is in its home pose at the start, whatever its counters say.
        switch: Whether the board has a button.
        lets_go: Time without a command after which the board or its link switches the currents off
            [s].
    """

    def __init__(
        self,
        unit: Unit,
        link: Link,
        first: Reported,
        *,
        force: bool = True,
        home_here: bool = False,
        switch: bool = False,
        lets_go: float = SERIAL_LETS_GO,
    ) -> None:
        self._unit, self._link, self._force = unit, link, force
        self.info = arm_info(unit, force=force, switch=switch, lets_go=lets_go)
        self._zero = first.counts if home_here else ZERO
        pose = self._pose_of(first)
        if pose is None:
            raise DeviceError(
                NAME,
                f"its encoders tell {first.counts}, a pose that it cannot have",
                "hold it in its home pose and press its calibration button, or add home=here",
            )
        self._pose, self._velocity, self._button = pose, ZERO, first.button
        self._heard: float | None = None  # when the newest report came
        self._now: float | None = None  # time of the last `read`
        # s; silence of the board, counted between reads and capped at `SILENCE` for each, because a
        # process that stood still could not hear the board.
        self._silent = 0.0
        self._closed = False

    def read(self, now: float) -> DeviceSample:
        """Return the newest state of the tip at time `now` [s].

        Raises:
            DeviceError: The board is gone or silent, or its encoders report an impossible pose.
        """
        if self._closed:
            raise DeviceError(NAME, "it is closed", "open it again")
        if self._heard is None:
            self._heard = now
        reported = self._link.poll(now)
        passed = 0.0 if self._now is None else max(0.0, min(now - self._now, SILENCE))
        self._now = now
        self._silent += passed
        if reported is not None:
            self._learn(reported, now)
        if self._silent > GIVE_UP:
            problem = f"its board has been silent for {1e3 * self._silent:.0f} ms"
            raise DeviceError(NAME, problem, "see to its cable")
        return DeviceSample(
            self._pose.position,
            self._velocity,
            buttons=int(self._button),
            fresh=self._silent <= SILENCE,
        )

    def write(self, force: Vec3) -> None:
        """Apply `force` [N] within the current limit of the motors; raise as `read`."""
        if self._closed:
            raise DeviceError(NAME, "it is closed", "open it again")
        if not self._force or not is_finite(force):
            force = ZERO
        amperes = motor_currents(self._unit, self._pose.jacobian, force)
        self._link.send(scale(amperes, 1e3))

    def release(self) -> None:
        """Set the force on the hand to zero; may be called from another thread."""
        self._link.release()

    def close(self) -> None:
        """Set the currents to zero, then release the board; may be called twice."""
        if not self._closed:
            self._closed = True
            self._link.close()

    def _learn(self, reported: Reported, now: float) -> None:
        pose = self._pose_of(reported)
        assert self._heard is not None
        dt = now - self._heard
        largest = _JUMP + _FASTEST * max(0.0, dt)
        if pose is None or norm(sub(pose.position, self._pose.position)) > largest:
            raise DeviceError(
                NAME,
                "its encoders jumped",
                "was it calibrated in use? Hold it in its home pose, then start again",
            )
        if dt > SILENCE:
            self._velocity = ZERO
        elif dt > 0.0:
            measured = scale(sub(pose.position, self._pose.position), 1.0 / dt)
            self._velocity = lerp(self._velocity, measured, dt / (_FILTER + dt))
        else:  # two reports at the same time: the next report covers the motion of both
            return
        self._pose, self._button, self._heard = pose, reported.button, now
        self._silent = 0.0

    def _pose_of(self, reported: Reported) -> Pose | None:
        counts = sub(reported.counts, self._zero)
        return pose_at(self._unit, joint_angles(self._unit, add(counts, ZERO)))


def arm_info(unit: Unit, *, force: bool, switch: bool, lets_go: float) -> DeviceInfo:
    """Return the abilities of an arm with its board.

    Args:
        force: Whether the motors are used.
        switch: Whether the board has a button.
        lets_go: Time without a command after which the currents are switched off [s].
    """
    return DeviceInfo(
        NAME,
        max_force=unit.max_force if force else 0.0,
        max_stiffness=unit.max_stiffness,
        max_damping=unit.max_damping,
        resolution=resolution(unit),
        latency=0.001,
        force_axes=3 if force else 0,
        switch=switch,
        lets_go=lets_go,
    )
