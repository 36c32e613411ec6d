"""Chooses an evenly spread subset of points."""

from __future__ import annotations

import numpy as np

from cohaptic_server.numeric import Floats, Ints


def spread_over(points: Floats, count: int) -> Ints:
    """Choose points by farthest-point sampling: each is the farthest from those chosen before.

    Args:
        points: Positions to choose from, shape (n, 3) [m].
        count: Largest number of points.

    Returns:
        Indices of the chosen points, shape (min(n, count),).
    """
    if len(points) <= count:
        return np.arange(len(points), dtype=np.int64)
    chosen = [int(np.argmin(points[:, 0]))]
    gap = np.full(len(points), np.inf)
    while len(chosen) < count:
        off = points - points[chosen[-1]]
        gap = np.minimum(gap, np.einsum("ni,ni->n", off, off))
        chosen.append(int(gap.argmax()))
    return np.array(chosen, dtype=np.int64)
