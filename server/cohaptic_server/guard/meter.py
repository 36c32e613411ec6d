"""Checks the recent messages of one connection against its budgets."""

from __future__ import annotations

from cohaptic.errors import CloseCode, RemoteProtocolError
from cohaptic_server.guard.budget import FULL, Budget, spend
from cohaptic_server.guard.limits import Limits


class Meter:
    """Counts the messages of one connection, and reports an error if they exceed its budgets.

    Args:
        simulation_hz: Ticks of the server per second [Hz].
    """

    def __init__(self, limits: Limits, simulation_hz: float) -> None:
        self._limits = limits
        self._sample_budget = limits.samples_at(simulation_hz)
        self._samples = self._texts = self._beats = FULL

    def sample(self, now: float) -> RemoteProtocolError | None:
        """Count a read with one sample, the usual case; returns an error if the budget is spent."""
        bucket = spend(self._samples, 1.0, self._sample_budget, now)
        if bucket is None:
            return too_many("samples", 1, self._sample_budget)
        self._samples = bucket
        return None

    def read(self, samples: int, texts: int, beats: int, now: float) -> RemoteProtocolError | None:
        """Count the messages of one read of the socket.

        Args:
            samples: Small binary messages.
            texts: Other messages and fragments.
            beats: Pings, pongs and closes.
            now: Time [s].

        Returns:
            Error if a budget is exceeded; None if not.
        """
        limits = self._limits
        # A read that brings less than a frame costs time as well.
        left = spend(self._samples, max(1, samples), self._sample_budget, now)
        if left is None:
            return too_many("samples", samples, self._sample_budget)
        self._samples = left
        if texts:
            left = spend(self._texts, texts, limits.texts, now)
            if left is None:
                return too_many("control messages", texts, limits.texts)
            self._texts = left
        if beats:
            left = spend(self._beats, beats, limits.beats, now)
            if left is None:
                return too_many("pings and pongs", beats, limits.beats)
            self._beats = left
        return None


def too_many(what: str, more: int, budget: Budget) -> RemoteProtocolError:
    """Error for a client that has exceeded a budget."""
    value, limit = f"too many: {more} more", f"at most {budget}"
    return RemoteProtocolError(f"number of {what}", value, limit, CloseCode.TOO_MANY)
