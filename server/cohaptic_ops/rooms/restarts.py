"""When a process that has ended is started again."""

from __future__ import annotations

from dataclasses import dataclass, replace

FIRST = 0.5  # s; the pause after a second end in a row
LONGEST = 30.0  # s; what does not start at all costs a second of a processor each time
LASTING = 10.0  # s; who was there for so long has no fault that it always has


@dataclass(frozen=True, slots=True)
class Restarts:
    """Restarts of one process. The first end in a row costs no pause: its users wait.

    Args:
        in_a_row: Ends, each soon after the start.
        count: Ends so far.
    """

    in_a_row: int = 0
    count: int = 0

    def ended(self, ready: float | None, now: float) -> Restarts:
        """The process has ended.

        Args:
            ready: Since when it was of use [s]; None if it never was.
            now: Time [s].
        """
        lasted = ready is not None and now - ready >= LASTING
        return replace(self, in_a_row=1 if lasted else self.in_a_row + 1, count=self.count + 1)

    @property
    def pause(self) -> float:
        """How long to wait before it is started again [s]."""
        if self.in_a_row <= 1:
            return 0.0
        return float(min(LONGEST, FIRST * 2.0 ** min(self.in_a_row - 2, 16)))
