"""Tells whether patches and haptic periods came on time, so that a force may be accused.

A control loop is unstable by itself: its force swings although everything comes on time. On a busy
machine, or over a link whose delay varies, a force swings for another reason, and so one interval
of a demonstration accuses a force only if nothing came late in it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from cohaptic_server.numeric import Floats
from cohaptic_tools.demo.analysis import Recording


class Blame(Enum):
    """Reason for which patches or haptic periods came late: the machine, or the injected jitter."""

    MACHINE = "machine"
    LINK = "link"


@dataclass(frozen=True, slots=True)
class Lateness:
    """Largest lateness in an interval.

    Args:
        patch: Time by which a patch came later than most of the interval's patches [s].
        stall: Time between the starts of two successive haptic periods [s].
    """

    patch: float = 0.0
    stall: float = 0.0

    def blame(self, period: float, jitter: float) -> Blame | None:
        """Return the cause of what came late; None if everything came on time.

        Up to a whole simulation period counts as on time: a patch that comes so late still comes
        before its successor. On idle cores the latest of a thousand patches is half as late.

        Args:
            period: Simulation period [s].
            jitter: Largest injected jitter, one way [s].
        """
        if max(self.stall, self.patch - jitter) > period:
            return Blame.MACHINE
        return Blame.LINK if self.patch > period else None


def lateness(recording: Recording, start: float, end: float, period: float) -> Lateness:
    """Return the largest lateness in an interval of a recording.

    A patch of tick n that comes at the time t has the delay t - n period, plus a constant; between
    two patches the delay of the newest one grows, by a period if the next one is on time. The
    median over the patches of the interval counts as their usual delay.

    Args:
        recording: Recording of one user.
        start: Begin of the interval [s].
        end: End of the interval [s].
        period: Simulation period [s].
    """
    t, tick = recording.columns["t"], recording.columns["tick"]
    first, last = np.searchsorted(t, [start, end])
    t, tick = t[first:last], tick[first:last]
    if t.size < 2:
        return Lateness()
    delay = t - period * tick
    came = np.flatnonzero(np.diff(tick) > 0) + 1
    usual = float(np.median(delay[came])) if came.size else float(delay[0])
    waited = float(delay.max()) - usual - period
    return Lateness(max(0.0, waited), float(np.diff(t).max()))


def most(found: Sequence[Lateness]) -> Lateness:
    """Return the largest patch lateness and the longest stall of several intervals or users."""
    return Lateness(
        max((late.patch for late in found), default=0.0),
        max((late.stall for late in found), default=0.0),
    )


def in_stretches(
    recordings: Sequence[Recording], t: Floats, stretches: Sequence[slice], period: float
) -> list[list[Lateness]]:
    """Return the lateness of each user, in the order of the recordings, in each stretch.

    Args:
        recordings: Recordings of all users.
        t: Time grid to whose indices the stretches refer [s], shape (n,).
        stretches: Intervals of indices of the grid.
        period: Simulation period [s].
    """
    spans = [(float(t[s.start]), float(t[s.stop - 1])) for s in stretches if s.stop > s.start]
    return [[lateness(r, start, end, period) for start, end in spans] for r in recordings]
