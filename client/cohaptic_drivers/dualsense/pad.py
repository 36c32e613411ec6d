"""A DualSense as a device in its own frame, whose axes point right, away from the user and up."""

from __future__ import annotations

from typing import Protocol

from cohaptic.errors import DeviceError
from cohaptic.vec import ZERO, Vec3, norm
from cohaptic_client.devices.device import DeviceInfo, DeviceSample
from cohaptic_drivers.dualsense.cursor import (
    Cursor,
    Room,
    moved,
    position,
    pull_of,
    velocity,
)
from cohaptic_drivers.dualsense.feeling import CONTACT, NOTHING_FELT, felt
from cohaptic_drivers.dualsense.link import LEAST_GAP, SILENCE
from cohaptic_drivers.dualsense.reports import LARGEST, NAME, Effects, Held

GIVE_UP = 0.25  # s; after a longer silence the pad counts as gone
_RATE = 250.0  # Hz; rate of the pad's reports, by users' measurements (the Edge: 1 kHz)


class Link(Protocol):
    """Connection to a pad; none of its calls waits for the pad."""

    def poll(self) -> Held | None:
        """Return the newest report since the last call; raise DeviceError when the pad is gone."""
        ...

    def send(self, effects: Effects) -> None:
        """Set the effects that are sent to the pad; raise as `poll`."""
        ...

    def release(self) -> None:
        """Switch all effects off; may be called from another thread."""
        ...

    def close(self) -> None:
        """Switch all effects off, then release the pad."""
        ...


class Pad:
    """A DualSense whose tip moves near an object at the origin of the device's frame.

    Args:
        link: Connection to the pad; this object closes it.
        first: First report of the pad.
        room: Region in which the tip moves.
        start: First coordinate of the tip along the trigger's direction, from the object's centre
            [m].
        full: Force that the largest resistance of the trigger stands for [N].
    """

    def __init__(self, link: Link, first: Held, room: Room, *, start: float, full: float) -> None:
        self.info = pad_info(room.depth, full)
        self._link, self._held, self._room, self._full = link, first, room, full
        self._cursor = Cursor(base=start)
        self._feeling = NOTHING_FELT
        self._force = ZERO
        self._now: float | None = None
        # s; silence of the pad, counted between reads and capped at `SILENCE` for each, because a
        # process that stood still could not hear the pad.
        self._silent = 0.0
        self._closed = False

    def read(self, now: float) -> DeviceSample:
        """Move the tip on to time `now` [s]; the tip stands still while the pad is silent.

        Raises:
            DeviceError: The pad was unplugged, is silent for too long, or is closed.
        """
        if self._closed:
            raise DeviceError(NAME, "it is closed", "open it again")
        reported = self._link.poll()
        dt = 0.0 if self._now is None else max(0.0, min(now - self._now, SILENCE))
        self._now = now
        if reported is not None:
            self._held, self._silent = reported, 0.0
        else:
            self._silent += dt
        if self._silent > GIVE_UP:
            problem = f"it has been silent for {1e3 * self._silent:.0f} ms"
            raise DeviceError(NAME, problem, "see to its cable")
        axes = self._room.axes
        if self._silent > SILENCE:
            where = position(self._cursor, axes)
            return DeviceSample(where, ZERO, buttons=self._held.buttons, fresh=False)
        contact = norm(self._force) > CONTACT
        self._cursor = moved(self._cursor, self._held, dt, self._room, contact=contact)
        return DeviceSample(
            position(self._cursor, axes),
            velocity(self._cursor, axes),
            buttons=self._held.buttons,
        )

    def write(self, force: Vec3) -> None:
        """Convert `force` [N] to effects and send them; raise as `read`."""
        if self._closed:
            raise DeviceError(NAME, "it is closed", "open it again")
        self._force = force
        self._feeling = felt(
            self._feeling,
            force,
            pull=pull_of(self._cursor, self._room),
            inward=self._room.axes.inward,
            full=self._full,
            now=self._now or 0.0,
        )
        self._link.send(self._feeling.effects)

    def release(self) -> None:
        """Switch all effects off; may be called from another thread."""
        self._link.release()

    def close(self) -> None:
        """Switch all effects off, then release the pad; may be called twice."""
        if not self._closed:
            self._closed = True
            self._link.close()


def pad_info(depth: float, full: float) -> DeviceInfo:
    """Return the abilities of a pad.

    Args:
        depth: Motion of the tip over the whole stroke of the trigger [m].
        full: Force that the largest resistance stands for; it has not been measured [N].
    """
    return DeviceInfo(
        "dualsense, not calibrated in newtons",
        max_force=full,
        # A brake stores no energy, so no stiffness is unstable; the value is the SpaceMouse's.
        max_stiffness=1000.0,
        resolution=depth / LARGEST,
        latency=1.0 / _RATE + LEAST_GAP,
        rate=_RATE,
        force_axes=1,
        lets_go=SILENCE,
    )
