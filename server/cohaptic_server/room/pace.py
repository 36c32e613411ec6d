"""When ticks are due, which of them were missed, and whether the machine keeps up. Without a clock.

A tick is missed when its patches leave after the next tick was due: from then on its users act on a
surface that should have been replaced. A tick that is left out, because the one before took so long
that its own successor is due, is missed as well.
"""

from __future__ import annotations

import numpy as np

from cohaptic.status.histogram import Histogram
from cohaptic.status.quantiles import Tally
from cohaptic_server.numeric import Mask

WINDOW = 10.0  # s; over less, one process that starts elsewhere looks like a slow machine
# Share of missed ticks in a window from which on the machine does not keep up. A desktop misses one
# tick in hundreds for reasons that pass; at one in ten, hands feel the surface lag all the time.
TOO_MANY = 0.1


def is_missed(due: float, written: float, period: float) -> bool:
    """Whether a tick was missed.

    Args:
        due: When it was due [s].
        written: When the last of its patches was written [s].
        period: Simulation period [s].
    """
    return written > due + period


def next_tick(due: float, now: float, period: float) -> tuple[float, int]:
    """When the next tick is due [s], and how many before it are left out.

    Args:
        due: When the last one was due [s].
        now: Time [s].
        period: Simulation period [s].
    """
    late = now - (due + period)
    left_out = int(late / period) if late > period else 0
    return due + (1 + left_out) * period, left_out


def passed_over(due: float, now: float, period: float) -> tuple[float, int]:
    """When the last tick was due that a room has slept through [s], and how many there were.

    Args:
        due: When the last one before them was due [s].
        now: Time [s].
        period: Simulation period [s].
    """
    ticks = max(0, int((now - due) / period))
    return due + ticks * period, ticks


class TickMeters:
    """Counts the ticks of a server; a fresh one starts from nothing.

    Attributes:
        ticks: Due so far, those that were left out or slept through as well.
        missed: Number of missed periods of these.
        left_out: Those of the missed ticks that were left out.
        slept: Those of the other ticks that a room slept through.
        cost: Time from each tick's start until its patches are written [s].
        late: Delay of each tick's start [s].
        watch_cost: Time for serving the watchers after a tick [s].
        costs, delays: `cost` and `late` in buckets with fixed edges, for those who collect them.
        deep, fast: Times a user's force was limited in a tick, as `world.users.Applied` counts.
    """

    def __init__(self) -> None:
        self.ticks = self.missed = self.left_out = self.slept = 0
        self.cost, self.late, self.watch_cost = Tally(), Tally(), Tally()
        self.costs, self.delays = Histogram(), Histogram()
        self.deep = self.fast = 0

    def leave_out(self, count: int) -> None:
        """Count ticks that are left out."""
        self.ticks += count
        self.missed += count
        self.left_out += count

    def pass_over(self, count: int) -> None:
        """Count ticks that a room has slept through; they were not missed."""
        self.ticks += count
        self.slept += count

    def limit(self, deep: Mask, fast: Mask) -> None:
        """Count the forces that a tick has limited, as `world.users.Applied` has them."""
        self.deep += int(np.count_nonzero(deep))
        self.fast += int(np.count_nonzero(fast))

    def add(self, due: float, started: float, written: float, period: float) -> None:
        """Count a tick.

        Args:
            due: When it was due [s].
            started: When it began [s].
            written: When the last of its patches was written [s].
            period: Simulation period [s].
        """
        self.ticks += 1
        self.missed += is_missed(due, written, period)
        late, cost = max(0.0, started - due), written - started
        self.late.add(late)
        self.delays.add(late)
        self.cost.add(cost)
        self.costs.add(cost)


class Pace:
    """Whether the machine keeps up, window by window.

    Args:
        period: Simulation period [s].
    """

    def __init__(self, period: float) -> None:
        self._window = round(WINDOW / period)
        self._ticks = self._missed = 0
        self._keeps_up = True

    def see(self, ticks: int, missed: int) -> str:
        """What there is to say, empty in general; a change is said once.

        Args:
            ticks: Due since the last call.
            missed: Number of missed periods of these.
        """
        if ticks > self._window:
            # The process or the machine was halted for longer than a window, which is not slowness.
            self._ticks = self._missed = 0
            return ""
        self._ticks += ticks
        self._missed += missed
        if self._ticks < self._window:
            return ""
        of = f"{self._missed} of the last {self._ticks} ticks were missed"
        kept_up, self._keeps_up = self._keeps_up, self._missed < TOO_MANY * self._ticks
        self._ticks = self._missed = 0
        if kept_up == self._keeps_up:
            return ""
        return f"the machine {'keeps up again' if self._keeps_up else 'cannot keep up'}: {of}"
