"""A clock that only advances on request, so that tests can cover hours of haptics at once."""

from __future__ import annotations


class ManualClock:
    """A `cohaptic.clock.Clock` that only `sleep_until` advances.

    Args:
        now: First reading [s].
    """

    def __init__(self, now: float = 0.0) -> None:
        self._now = now

    def now(self) -> float:
        """Return the time since this clock's origin [s]."""
        return self._now

    def sleep_until(self, when: float) -> None:
        """Advance the clock to `when` [s] at once; do nothing if that time has passed."""
        self._now = max(self._now, when)
