"""Progress of a long computation: type of the callback, and a forecast of the remaining time."""

from __future__ import annotations

import math
from collections.abc import Callable

Progress = Callable[[str, float], None]  # takes the phase's name and completed fraction

_SOON = 2.0  # s; a phase has to run this long before its rate allows a forecast


class TimeLeft:
    """Forecasts the remaining time of a phase from its mean rate so far.

    Args:
        begin: Time at which the phase began [s].
    """

    def __init__(self, begin: float) -> None:
        self._begin = begin

    def seconds(self, fraction: float, now: float) -> float:
        """Return the remaining time [s]; infinite while it is too early for a forecast.

        Args:
            fraction: Completed fraction of the phase, from 0 to 1.
            now: Present time on the clock of `begin` [s].
        """
        spent = now - self._begin
        if fraction <= 0.0 or spent < _SOON:
            return math.inf
        return spent * max(0.0, 1.0 - fraction) / fraction

    def words(self, fraction: float, now: float) -> str:
        """Return the remaining time as a text in min:s, `1:20 left`; empty if it is infinite."""
        seconds = self.seconds(fraction, now)
        if not math.isfinite(seconds):
            return ""
        return f"{int(seconds) // 60}:{int(seconds) % 60:02d} left"
