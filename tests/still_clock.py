"""A clock that stands still until a test moves it, or somebody sleeps."""

from __future__ import annotations


class StillClock:
    """A `cohaptic.clock.Clock`.

    Args:
        t: Time at first [s].
    """

    def __init__(self, t: float = 100.0) -> None:
        self.t = t

    def now(self) -> float:
        return self.t

    def sleep_until(self, when: float) -> None:
        self.t = when
