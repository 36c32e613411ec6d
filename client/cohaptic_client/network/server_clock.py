"""The server's clock for a connection that sends no samples: from times that come, and pings.

What the server sends at a time on its clock comes later by its way: the quickest of it is late by
the shortest way. The shortest round trip of a ping is both ways; half of it is taken for one, and
bounds the error, as for a client with samples (`timing.py`). Both are of the last seconds, since
clocks drift.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from cohaptic_client.network.timing import WINDOW

# Times and pings before the estimate counts: the first may wait behind a mesh on a slow link, or
# for the end of a tick.
FIRST = 3


class ClockReading(NamedTuple):
    """What is known of the server's clock.

    Args:
        to_server: The server's clock less this one's [s].
        error: Bound on the error of `to_server` [s].
    """

    to_server: float
    error: float


class ServerClock:
    """Estimates the server's clock; times are those of one clock of this machine [s]."""

    def __init__(self) -> None:
        self._ahead, self._nearness = _Recent(), _Recent()
        self._heard = self._answered = 0

    def heard(self, t_server: float, now: float) -> None:
        """Take a time that the server has sent, and the time at which it came."""
        self._ahead.take(t_server - now, now)
        self._heard += 1

    def answered(self, trip: float, now: float) -> None:
        """Take the duration of a round trip that has just ended [s]."""
        self._nearness.take(-trip, now)
        self._answered += 1

    @property
    def reading(self) -> ClockReading | None:
        """The estimate; None before the first few times and round trips."""
        if min(self._heard, self._answered) < FIRST:
            return None
        trip = -self._nearness.largest
        return ClockReading(self._ahead.largest + 0.5 * trip, 0.5 * trip)


class _Recent:
    """Largest of the values of the last `WINDOW`, and of up to another one before."""

    def __init__(self) -> None:
        self._now = self._before = self._until = -math.inf

    @property
    def largest(self) -> float:
        return max(self._now, self._before)

    def take(self, value: float, now: float) -> None:
        if now >= self._until:
            self._before, self._now, self._until = self._now, value, now + WINDOW
        else:
            self._now = max(self._now, value)
