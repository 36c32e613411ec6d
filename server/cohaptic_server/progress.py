"""Type of a progress callback, and a forecast of the time that a phase still takes."""

from __future__ import annotations

import math
from collections.abc import Callable

Progress = Callable[[str, float], None]  # name of the phase, and the share of it that is done

_SOON = 2.0  # s from the start of a phase until its rate is known well enough for a forecast


class TimeLeft:
    """Forecasts the time that a phase still takes from its mean rate so far.

    Args:
        begin: Time at which the phase began [s].
    """

    def __init__(self, begin: float) -> None:
        self._begin = begin

    def seconds(self, share: float, now: float) -> float:
        """Time left [s]; infinite until the rate is known.

        Args:
            share: Share of the phase that is done, from 0 to 1.
            now: Time [s].
        """
        spent = now - self._begin
        if share <= 0.0 or spent < _SOON:
            return math.inf
        return spent * max(0.0, 1.0 - share) / share

    def words(self, share: float, now: float) -> str:
        """Time left in words, `1:20 left`; empty until the rate is known."""
        seconds = self.seconds(share, now)
        if not math.isfinite(seconds):
            return ""
        return f"{int(seconds) // 60}:{int(seconds) % 60:02d} left"
