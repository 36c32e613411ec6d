"""The delay of one client's loop, from what is measured, such that gains never chatter.

A sample names the tick of the patch that it was made with; the tick that takes it in is so many
periods later. That is the d + 1 of science 3.1, network, schedulers and all, and needs no clock.
"""

from __future__ import annotations

from dataclasses import dataclass

WINDOW = 4.0  # s; a delay counts for at least this long and at most twice that
UNKNOWN = 1.0  # s; before the first measurement
LONGEST = 10.0  # s; a client that says more is wrong about its patches
# Of a loop that may take part: 400 ms of jitter on top of 250 ms each way, and as much again. The
# room waits for its slowest hand, so a slower one may only watch.
TOO_LONG = 2.0  # s


@dataclass(frozen=True, slots=True)
class LoopDelay:
    """Largest delay of late: rises at once, falls when nothing has come near it for a while.

    Args:
        recent: Largest in the present window [s]; negative before the first measurement.
        before: Largest in the window before [s].
        until: End of the present window [s].
    """

    recent: float = -1.0
    before: float = -1.0
    until: float = 0.0

    @property
    def value(self) -> float:
        """Delay that gains are chosen for [s]."""
        largest = max(self.recent, self.before)
        return largest if largest >= 0.0 else UNKNOWN

    @property
    def counted(self) -> float:
        """What the room's lag counts: nothing before the first measurement [s]."""
        return min(TOO_LONG, max(0.0, self.recent, self.before))

    @property
    def too_long(self) -> bool:
        """Whether this loop is too slow to take part."""
        return max(self.recent, self.before) > TOO_LONG

    def measured(self, delay: float, now: float) -> LoopDelay:
        """A sample took `delay` [s] round the loop."""
        delay = min(max(delay, 0.0), LONGEST)
        if now < self.until:
            return LoopDelay(max(self.recent, delay), self.before, self.until)
        return LoopDelay(delay, self.recent, now + WINDOW)
