"""Back-off between the restarts of a process that ends again and again."""

from __future__ import annotations

from dataclasses import dataclass, replace

FIRST = 0.5  # s; the pause after the second end in a row
LONGEST = 30.0  # s; each failed start costs a second of processor time
LASTING = 10.0  # s; an end after a longer time counts as the first in a row


@dataclass(frozen=True, slots=True)
class Restarts:
    """Number of ends of one process, from which the back-off follows.

    The first restart has no pause, since users wait.

    Args:
        in_a_row: Number of ends since a process last ran for `LASTING` or longer, including the end
            of that process.
        count: Number of all ends so far.
    """

    in_a_row: int = 0
    count: int = 0

    def ended(self, ready: float | None, now: float) -> Restarts:
        """Return the counters after one more end of the process.

        Args:
            ready: Time since which the process was ready [s]; None if it never was.
            now: Time [s].
        """
        lasted = ready is not None and now - ready >= LASTING
        return replace(self, in_a_row=1 if lasted else self.in_a_row + 1, count=self.count + 1)

    @property
    def pause(self) -> float:
        """Pause before the process is started again [s]."""
        if self.in_a_row <= 1:
            return 0.0
        return float(min(LONGEST, FIRST * 2.0 ** min(self.in_a_row - 2, 16)))
