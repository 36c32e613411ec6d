"""Limits the rate of log lines about each address, so that no address fills a disk."""

from __future__ import annotations

from dataclasses import dataclass

from cohaptic_server.guard.budget import FULL, Budget, spend

_MOST_SOURCES = 1024


@dataclass(frozen=True, slots=True)
class _Source:
    bucket: float = FULL
    left_out: int = 0
    since: float = 0.0  # time of the first line that was left out [s]


class LogLines:
    """Rate limits of log lines, one for each address, with the numbers of omitted lines.

    Args:
        budget: Budget of each address.
    """

    def __init__(self, budget: Budget) -> None:
        self._budget = budget
        self._known: dict[str, _Source] = {}

    def pass_on(self, source: str, now: float) -> bool:
        """Count a line about an address, and return whether the line is to be written."""
        known = self._known.pop(source, _Source())
        spent = spend(known.bucket, 1.0, self._budget, now)
        if spent is None:
            since = known.since if known.left_out else now
            self._known[source] = _Source(known.bucket, known.left_out + 1, since)
        else:
            self._known[source] = _Source(spent, known.left_out, known.since)
        while len(self._known) > _MOST_SOURCES:
            self._known.pop(next(iter(self._known)))
        return spent is not None

    def left_out(self, now: float, after: float = 0.0) -> list[tuple[str, int]]:
        """Return the addresses and the number of omitted lines about each, and reset the numbers.

        Args:
            now: Time [s].
            after: Only addresses whose first omitted line is at least this old are returned [s].
        """
        due = [
            (name, known.left_out)
            for name, known in self._known.items()
            if known.left_out and now - known.since >= after
        ]
        for name, _ in due:
            self._known[name] = _Source(self._known[name].bucket)
        return due
