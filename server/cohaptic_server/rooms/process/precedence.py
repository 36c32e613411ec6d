"""Which rooms go before ordinary processes.

The threads of equal real-time priority are not preempted for each other: on two cores, two rooms
whose ticks take longer than a period would stop every other room for good. A room that takes more
than its share of a core therefore loses its priority until it takes less.
"""

from __future__ import annotations

# Of a core. A tick within half of its period leaves others their turn in each of theirs.
MOST = 0.5
LESS = 0.25
CALM = 5.0  # s below `LESS` before it goes first again: one that swings about the limit does not


class Precedence:
    """Of one room.

    Attributes:
        first: Whether it goes before ordinary processes.
    """

    def __init__(self) -> None:
        self.first = True
        self._calm_since: float | None = None

    def see(self, share: float, now: float) -> bool:
        """Take in what its ticks took lately; returns whether `first` changed.

        Args:
            share: Of a core that its ticks want: processor time of one over their period.
            now: Time [s].
        """
        before = self.first
        if share > MOST:
            self.first, self._calm_since = False, None
        elif share > LESS:
            self._calm_since = None
        elif not self.first:
            if self._calm_since is None:
                self._calm_since = now
            self.first = now - self._calm_since >= CALM
        return self.first != before
