"""Due times of ticks, missed ticks, and whether the machine keeps up. Reads no clock.

A tick is missed when its patches are written after the next tick was due, since users then act on
an outdated surface. If a tick takes so long that the next one starts more than a period late, the
server omits ticks; omitted ticks count as missed as well.
"""

from __future__ import annotations

import numpy as np

from cohaptic.status.quantiles import Histogram, Tally
from cohaptic_server.numeric import Mask

WINDOW = 10.0  # s; in a shorter window, the start of another process looks like a slow machine
# Fraction of missed ticks in a window from which on the machine does not keep up. A desktop misses
# one tick in hundreds for passing reasons; at one in ten, hands feel the surface lag all the time.
TOO_MANY = 0.1


def is_missed(due: float, written: float, period: float) -> bool:
    """Whether a tick was missed: its last patch was written after the next tick was due.

    Args:
        due: Time at which the tick was due [s].
        written: Time at which the last patch of the tick was written [s].
        period: Simulation period [s].
    """
    return written > due + period


def next_tick(due: float, now: float, period: float) -> tuple[float, int]:
    """Return the time at which the next tick is due [s], and the number of ticks omitted before it.

    Args:
        due: Time at which the last tick was due [s].
        now: Time [s].
        period: Simulation period [s].
    """
    late = now - (due + period)
    left_out = int(late / period) if late > period else 0
    return due + (1 + left_out) * period, left_out


def passed_over(due: float, now: float, period: float) -> tuple[float, int]:
    """Return the due time of the last tick that a room slept through [s], and the number of them.

    Args:
        due: Time at which the last tick before the sleep was due [s].
        now: Time [s].
        period: Simulation period [s].
    """
    ticks = max(0, int((now - due) / period))
    return due + ticks * period, ticks


class TickMeters:
    """Counters and time statistics of a server's ticks.

    Attributes:
        ticks: Number of ticks due so far, including ticks that were omitted or slept through.
        missed: Number of missed ticks among `ticks`.
        left_out: Number of omitted ticks among `missed`.
        slept: Number of ticks that a room without peers slept through; none of them is missed.
        cost: Time from a tick's start until its patches are written [s].
        late: Delay of a tick's start after its due time [s].
        watch_cost: Time for serving the watchers after a tick [s].
        costs: Histogram of `cost` with fixed edges, for monitoring.
        delays: Histogram of `late` with fixed edges, for monitoring.
        deep: Number of times that a tick cut a user's force to the limit of its contact or of the
            body.
        fast: Number of times that a tick cut the change of a user's force for the sake of other
            users.
    """

    def __init__(self) -> None:
        self.ticks = self.missed = self.left_out = self.slept = 0
        self.cost, self.late, self.watch_cost = Tally(), Tally(), Tally()
        self.costs, self.delays = Histogram(), Histogram()
        self.deep = self.fast = 0

    def leave_out(self, count: int) -> None:
        """Count omitted ticks, which are also missed."""
        self.ticks += count
        self.missed += count
        self.left_out += count

    def pass_over(self, count: int) -> None:
        """Count ticks that a room has slept through; these ticks are not missed."""
        self.ticks += count
        self.slept += count

    def limit(self, deep: Mask, fast: Mask) -> None:
        """Count the users whose forces a tick has limited.

        Args:
            deep: Mask `world.users.Applied.deep` of the tick's users.
            fast: Mask `world.users.Applied.fast` of the tick's users.
        """
        self.deep += int(np.count_nonzero(deep))
        self.fast += int(np.count_nonzero(fast))

    def add(self, due: float, started: float, written: float, period: float) -> None:
        """Count one tick that was computed.

        Args:
            due: Time at which the tick was due [s].
            started: Time at which the tick began [s].
            written: Time at which the last patch of the tick was written [s].
            period: Simulation period [s].
        """
        self.ticks += 1
        self.missed += is_missed(due, written, period)
        late, cost = max(0.0, started - due), written - started
        self.late.add(late)
        self.delays.add(late)
        self.cost.add(cost)
        self.costs.add(cost)


class MissedTickMonitor:
    """Judges from the fraction of missed ticks in successive windows whether the machine keeps up.

    Args:
        period: Simulation period [s].
    """

    def __init__(self, period: float) -> None:
        self._window = round(WINDOW / period)
        self._ticks = self._missed = 0
        self._keeps_up = True

    def see(self, ticks: int, missed: int) -> str:
        """Count ticks; return a message if the machine begins or ceases to keep up, otherwise "".

        Args:
            ticks: Number of ticks due since the last call.
            missed: Number of these ticks that were missed.
        """
        if ticks > self._window:
            # The process or the machine was halted for longer than a window and is not slow.
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
