"""Progress of a long preparation, as it is reported to whoever waits."""

from __future__ import annotations

import math
from collections.abc import Callable

Progress = Callable[[str, float], None]  # name of the phase, and the share of it that is done

_SOON = 2.0  # s from the start of a phase until its rate is known well enough to say what is left


class TimeLeft:
    """The time that is left of a phase, by the rate at which its share has grown so far.

    Args:
        begin: When the phase began [s].
    """

    def __init__(self, begin: float) -> None:
        self._begin = begin

    def seconds(self, share: float, now: float) -> float:
        """Time left [s]; infinite while nothing is known.

        Args:
            share: Share of the phase that is done, from 0 to 1.
            now: Time [s].
        """
        spent = now - self._begin
        if share <= 0.0 or spent < _SOON:
            return math.inf
        return spent * max(0.0, 1.0 - share) / share

    def words(self, share: float, now: float) -> str:
        """`1:20 left`; empty while nothing is known."""
        seconds = self.seconds(share, now)
        if not math.isfinite(seconds):
            return ""
        return f"{int(seconds) // 60}:{int(seconds) % 60:02d} left"
