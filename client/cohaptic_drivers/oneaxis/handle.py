"""The handle of a one-axis board as a device in its own frame: right, away from the user, up.

The handle moves and pushes only along one axis, through the object's middle: the hand does not feel
the component of a force across that axis.
"""

from __future__ import annotations

import math
from typing import Protocol

from cohaptic.errors import DeviceError
from cohaptic.vec import ZERO, Vec3, dot, is_finite, scale
from cohaptic_client.devices.device import DeviceInfo, DeviceSample
from cohaptic_drivers.oneaxis.frames import NAME, Description, Report
from cohaptic_drivers.oneaxis.unit import Unit

SILENCE = 0.02  # s; after a longer silence of the board its last counts are out of date
GIVE_UP = 0.25  # s; after a longer silence the board counts as gone
LETS_GO = 0.05  # s; silence of the host after which our firmware switches its motor off
LIMIT = 0.5  # A; largest current that our firmware gives a Hapkit's motor
COUNTS = 2048  # per turn of a Hapkit's motor, as set in `one_axis_board.ino`
# s; one count is 0.01 to 0.1 mm, or up to 100 mm/s in a period of 1 ms; the filter leaves a fifth.
_FILTER = 0.004
# m between two reports; at 1 kHz that is 10 m/s, faster than a hand: the sensor has skipped, or the
# report is garbage.
_JUMP = 0.01
_FASTEST = 1.5  # m/s; speed of the hand that is allowed besides `_JUMP`
_WRAP = 2.0**32 * 1e-6  # s; after this time the board's clock wraps
_SHORTEST = 1e-4  # s; shortest time between two reports from which a velocity is computed


class Link(Protocol):
    """Connection to a board; none of its calls waits for the board."""

    def poll(self) -> Report | None:
        """Return the newest report since the last call; raise DeviceError if the board is gone."""
        ...

    def send(self, amperes: float) -> None:
        """Send this motor current [A]; raise as `poll`."""
        ...

    def release(self) -> None:
        """Set the current to zero at once; may be called from another thread."""
        ...

    def close(self) -> None:
        """Set the current to zero, then release the board."""
        ...


class Handle:
    """A handle on its axis; its position at the start counts as its middle.

    Args:
        link: Connection to its board; this object closes it.
        board: Description that the board sent of itself.
        first: First report of the board.
        axis: Direction in which the hand presses; a unit vector of the device's frame.
        force: Whether the motor is used.
    """

    def __init__(
        self,
        unit: Unit,
        link: Link,
        board: Description,
        first: Report,
        *,
        axis: Vec3,
        force: bool = True,
    ) -> None:
        self._unit, self._link, self._axis = unit, link, axis
        self.info = handle_info(unit, force=force, board=board)
        self._metres = unit.sensor_direction / unit.counts(board.counts)  # per count
        self._zero = first.counts
        self._report = first
        self._place = self._speed = 0.0
        self._now: float | None = None
        # s; silence of the board, counted between reads and capped at `SILENCE` for each, because a
        # process that stood still could not hear the board.
        self._silent = 0.0
        # Times at which the last two reports were read, the older first. While this process stood
        # still, the newer report may have waited in the port since the first of these times, so
        # the next report may be later by all the time since then, on the board's clock.
        self._heard = (-math.inf, -math.inf)
        self._closed = False

    def read(self, now: float) -> DeviceSample:
        """Return the newest state of the handle at time `now` [s].

        Raises:
            DeviceError: The board is gone or silent, started again, or reports an impossible
                motion.
        """
        self._check_open()
        reported = self._link.poll()
        passed = 0.0 if self._now is None else max(0.0, min(now - self._now, SILENCE))
        self._now = now
        self._silent += passed
        if reported is not None:
            self._learn(reported, now)
        if self._silent > GIVE_UP:
            problem = f"its board has been silent for {1e3 * self._silent:.0f} ms"
            raise DeviceError(NAME, problem, "see to its cable")
        fresh = self._silent <= SILENCE
        return DeviceSample(
            scale(self._axis, self._place),
            scale(self._axis, self._speed) if fresh else ZERO,
            buttons=int(self._report.button),
            fresh=fresh,
        )

    def write(self, force: Vec3) -> None:
        """Apply the component of `force` [N] along the axis; raise as `read`."""
        self._check_open()
        if not is_finite(force) or self.info.max_force == 0.0:
            force = ZERO
        self._link.send(self._unit.current(dot(force, self._axis)))

    def release(self) -> None:
        """Set the force on the hand to zero; may be called from another thread."""
        self._link.release()

    def close(self) -> None:
        """Set the current to zero, then release the board; may be called twice."""
        if not self._closed:
            self._closed = True
            self._link.close()

    def _check_open(self) -> None:
        if self._closed:
            raise DeviceError(NAME, "it is closed", "open it again")

    def _learn(self, reported: Report, now: float) -> None:
        if reported.faulty:
            advice = "see to its magnet and its cable, then plug it in again"
            raise DeviceError(NAME, "its board says that its sensor failed", advice)
        place = self._metres * (reported.counts - self._zero)
        # On the board's own clock, because delays by the cable or by this process are no motion.
        passed = (reported.time - self._report.time) % _WRAP
        if passed > now - self._heard[0] + SILENCE:
            advice = "see to its supply, then start again"
            raise DeviceError(NAME, "its board started anew", advice)
        largest = _JUMP + _FASTEST * passed
        if abs(place - self._place) > largest or abs(place) > 2.0 * self._unit.travel:
            advice = "hold the handle in its middle, then start again"
            raise DeviceError(NAME, "its sensor jumped", advice)
        if passed > SILENCE:
            self._speed = 0.0
        elif passed < _SHORTEST:  # two reports at the same time: the next one covers both motions
            return
        else:
            measured = (place - self._place) / passed
            self._speed += (measured - self._speed) * passed / (_FILTER + passed)
        self._place, self._report, self._silent = place, reported, 0.0
        self._heard = (self._heard[1], now)


def handle_info(unit: Unit, *, force: bool, board: Description | None = None) -> DeviceInfo:
    """Return the abilities of a handle.

    Args:
        force: Whether the motor is used.
        board: Description that the board sent; None to assume the values of our firmware.
    """
    limit, per_turn, lets_go = (
        (LIMIT, COUNTS, LETS_GO) if board is None else (board.limit, board.counts, board.watchdog)
    )
    largest = unit.most_force(limit) if force else 0.0
    return DeviceInfo(
        NAME,
        max_force=largest,
        max_stiffness=unit.max_stiffness,
        damping=unit.damping,
        max_damping=unit.max_damping,
        friction=unit.friction,
        resolution=1.0 / unit.counts(per_turn),
        latency=0.002,
        sensed_axes=1,
        force_axes=1 if largest > 0.0 else 0,
        lets_go=lets_go,
    )
