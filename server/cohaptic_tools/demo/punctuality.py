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
    """Reason for which patches or haptic periods came late: the machine, or the network."""

    MACHINE = "machine"
    LINK = "link"


# Share of a stretch that shows as well as all of it whether a force swings: what is left out is
# shorter than the transient of a press, with which every stretch begins.
_MAX_OF = 0.8


@dataclass(frozen=True, slots=True)
class Lateness:
    """Largest lateness in an interval.

    Args:
        patch: Time by which a patch came later than most of the interval's patches [s].
        stall: Time between the starts of two successive haptic periods [s].
    """

    patch: float = 0.0
    stall: float = 0.0

    def blame(self, period: float, wavers: float) -> Blame | None:
        """Return the cause of what came late; None if everything came on time.

        Up to a whole simulation period counts as on time: a patch that comes so late still comes
        before its successor. On idle cores the latest of a thousand patches is half as late.

        Args:
            period: Simulation period [s].
            wavers: Largest extra delay that the injected network adds, one way [s].
        """
        if max(self.stall, self.patch - wavers) > period:
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
    t, late = _late_by(recording, start, end, period)
    if t.size < 2:
        return Lateness()
    return Lateness(max(0.0, float(late.max())), float(np.diff(t).max()))


def part_on_time(
    recordings: Sequence[Recording], t: Floats, stretch: slice, period: float
) -> slice | None:
    """Return the longest part of a stretch in which nothing came late for anybody.

    Args:
        recordings: Recordings of all users.
        t: Time grid to whose indices the stretch refers [s], shape (n,).
        stretch: Interval of indices of the grid.
        period: Simulation period [s].

    Returns:
        Interval of indices; None if it is shorter than `_MAX_OF` of the stretch.
    """
    start, end = float(t[stretch.start]), float(t[stretch.stop - 1])
    spans = sorted(span for r in recordings for span in _late_spans(r, start, end, period))
    parts: list[slice] = []
    at = stretch.start
    for begin, over in spans:
        parts.append(slice(at, int(np.searchsorted(t, begin))))
        at = max(at, int(np.searchsorted(t, over)) + 1)
    parts.append(slice(at, stretch.stop))
    longest = max(parts, key=_length)
    return longest if _length(longest) >= _MAX_OF * _length(stretch) else None


def _late_spans(
    recording: Recording, start: float, end: float, period: float
) -> list[tuple[float, float]]:
    """Return begin and end of each time in which a patch was late or the loop stood still [s]."""
    t, late = _late_by(recording, start, end, period)
    if not t.size:
        return []
    beyond = np.concatenate([[False], late > period, [False]])
    begins, ends = np.flatnonzero(np.diff(beyond.astype(np.int8))).reshape(-1, 2).T
    halts = np.flatnonzero(np.diff(t) > period)
    return [
        *zip(t[begins].tolist(), t[ends - 1].tolist(), strict=True),
        *zip(t[halts].tolist(), t[halts + 1].tolist(), strict=True),
    ]


def _late_by(
    recording: Recording, start: float, end: float, period: float
) -> tuple[Floats, Floats]:
    """Return the times of an interval's rows, and by how much a patch is late then [s], both (n,).

    Before the first patch of all nothing can be late.
    """
    t, tick = recording.columns["t"], recording.columns["tick"]
    within = (t >= start) & (t < end) & (tick > 0)
    t, tick = t[within], tick[within]
    if not t.size:
        return t, t
    delay = t - period * tick
    came = np.flatnonzero(np.diff(tick) > 0) + 1
    usual = float(np.median(delay[came])) if came.size else float(delay[0])
    return t, delay - usual - period


def _length(part: slice) -> int:
    return int(part.stop) - int(part.start)


def limit(found: Sequence[Lateness]) -> Lateness:
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
