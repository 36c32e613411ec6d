"""The handle of a one-axis board as a device in its own frame: right, away from the user, up.

It moves and pushes along one axis only, which lies through the object's middle: what a force has
beside that axis is not felt.
"""

from __future__ import annotations

import math
from typing import Protocol

from cohaptic.errors import DeviceError
from cohaptic.vec import ZERO, Vec3, dot, is_finite, scale
from cohaptic_client.devices.device import DeviceInfo, DeviceSample
from cohaptic_drivers.oneaxis.frames import NAME, Description, Report
from cohaptic_drivers.oneaxis.unit import Unit

SILENCE = 0.02  # s; of a board, after which its last counts are old
GIVE_UP = 0.25  # s; of silence, after which it is gone
LETS_GO = 0.05  # s; of the host, after which our firmware switches its motor off
LIMIT = 0.5  # A; that our firmware gives a Hapkit's motor
COUNTS = 2048  # per turn of a Hapkit's motor, as its shell has it
# s; a count is 0.01 to 0.1 mm, in a period of 1 ms up to 100 mm/s: of that a fifth is left
_FILTER = 0.004
_JUMP = 0.01  # m between two reports; 10 m/s at 1 kHz are no hand. A sensor that skips, or garbage.
_FASTEST = 1.5  # m/s; what a hand may go meanwhile
_WRAP = 2.0**32 * 1e-6  # s; after which the board's clock runs over
_SHORTEST = 1e-4  # s between two reports that count for a velocity


class Link(Protocol):
    """The way to a board; no call waits for it."""

    def poll(self) -> Report | None:
        """The newest report since the last call; raises DeviceError when the board is gone."""
        ...

    def give(self, amperes: float) -> None:
        """Have this current sent; raises as `poll`."""
        ...

    def release(self) -> None:
        """No current, at once; for another thread."""
        ...

    def close(self) -> None:
        """No current, then release the board."""
        ...


class Handle:
    """A handle on its axis; where it is at first is its middle.

    Args:
        unit: As it was built.
        link: To its board; this object closes it.
        board: What the board said of itself.
        first: Its first report.
        axis: In which the hand presses; a unit vector of the device's frame.
        force: Whether its motor is used.
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
        self._metres = unit.sensor_direction / unit.counts(board.counts)  # for a count
        self._zero = first.counts
        self._told = first
        self._place = self._speed = 0.0
        self._now: float | None = None
        # s; of the board, while this object was read: a process that stood still heard nothing.
        self._silent = 0.0
        # When the newest report was read, and the one before: the newest may have waited since then
        # for a process that stood still, so that the next may be so much older by its own clock.
        self._heard = (-math.inf, -math.inf)
        self._closed = False

    def read(self, now: float) -> DeviceSample:
        """The newest state.

        Raises:
            DeviceError: The board is gone or silent, or tells what cannot be.
        """
        self._check_open()
        told = self._link.poll()
        passed = 0.0 if self._now is None else max(0.0, min(now - self._now, SILENCE))
        self._now = now
        self._silent += passed
        if told is not None:
            self._learn(told, now)
        if self._silent > GIVE_UP:
            problem = f"its board has been silent for {1e3 * self._silent:.0f} ms"
            raise DeviceError(NAME, problem, "see to its cable")
        fresh = self._silent <= SILENCE
        return DeviceSample(
            scale(self._axis, self._place),
            scale(self._axis, self._speed) if fresh else ZERO,
            buttons=int(self._told.button),
            fresh=fresh,
        )

    def write(self, force: Vec3) -> None:
        """Give the part of `force` [N] along the axis; raises as `read`."""
        self._check_open()
        if not is_finite(force) or self.info.max_force == 0.0:
            force = ZERO
        self._link.give(self._unit.current(dot(force, self._axis)))

    def release(self) -> None:
        """Take the force off the hand; for another thread."""
        self._link.release()

    def close(self) -> None:
        """No current, then release the board; may be called twice."""
        if not self._closed:
            self._closed = True
            self._link.close()

    def _check_open(self) -> None:
        if self._closed:
            raise DeviceError(NAME, "it is closed", "open it again")

    def _learn(self, told: Report, now: float) -> None:
        if told.faulty:
            advice = "see to its magnet and its cable, then plug it in again"
            raise DeviceError(NAME, "its board says that its sensor failed", advice)
        place = self._metres * (told.counts - self._zero)
        # By the board's own clock: what the cable or a process that stood still adds is no motion.
        passed = (told.time - self._told.time) % _WRAP
        if passed > now - self._heard[0] + SILENCE:
            advice = "see to its supply, then start again"
            raise DeviceError(NAME, "its board started anew", advice)
        most = _JUMP + _FASTEST * passed
        if abs(place - self._place) > most or abs(place) > 2.0 * self._unit.travel:
            advice = "hold the handle in its middle, then start again"
            raise DeviceError(NAME, "its sensor jumped", advice)
        if passed > SILENCE:
            self._speed = 0.0
        elif passed < _SHORTEST:  # two at one time: the way of both counts for the next
            return
        else:
            measured = (place - self._place) / passed
            self._speed += (measured - self._speed) * passed / (_FILTER + passed)
        self._place, self._told, self._silent = place, told, 0.0
        self._heard = (self._heard[1], now)


def handle_info(unit: Unit, *, force: bool, board: Description | None = None) -> DeviceInfo:
    """Abilities of a unit; before its board has spoken, with what our firmware says."""
    limit, per_turn, lets_go = (
        (LIMIT, COUNTS, LETS_GO) if board is None else (board.limit, board.counts, board.watchdog)
    )
    most = unit.most_force(limit) if force else 0.0
    return DeviceInfo(
        NAME,
        max_force=most,
        max_stiffness=unit.max_stiffness,
        damping=unit.damping,
        max_damping=unit.max_damping,
        friction=unit.friction,
        resolution=1.0 / unit.counts(per_turn),
        latency=0.002,
        sensed_axes=1,
        force_axes=1 if most > 0.0 else 0,
        lets_go=lets_go,
    )
