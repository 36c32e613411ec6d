"""A clock that only advances on request, so that tests can cover hours of haptics at once."""

from __future__ import annotations


class ManualClock:
    """A `cohaptic.clock.Clock` without real time.

    Args:
        now: First reading [s].
    """

    def __init__(self, now: float = 0.0) -> None:
        self._now = now

    def now(self) -> float:
        """Seconds since this clock's origin."""
        return self._now

    def sleep_until(self, when: float) -> None:
        """Jump to `when`; time never runs backwards."""
        self._now = max(self._now, when)
