"""How late the ticks of a room are, as the times in its patches tell it."""

from __future__ import annotations

import math

import numpy as np

from core_users import PERIOD

EARLY = 5e-4  # s by which a tick may be before the grid, which is an estimate


def lateness(ticks: list[float]) -> np.ndarray:
    """Lateness of each tick that was due between the first and the last [s]; shape (ticks,).

    Times are compared with a grid of `PERIOD` that most of them agree about; a tick that was left
    out counts as one period late.

    Args:
        ticks: Their times on the server's clock [s].
    """
    t = np.asarray(ticks)
    if len(t) < 2:
        return np.full(1, PERIOD)
    # Where the grid lies is what most ticks agree about: one that is late by most of a period is no
    # early one, though it looks like that.
    turns = 2.0 * np.pi * (t - t[0]) / PERIOD
    angle = math.atan2(float(np.sin(turns).sum()), float(np.cos(turns).sum()))
    offset = (
        np.mod(t - t[0] - angle / (2.0 * math.pi) * PERIOD + 0.5 * PERIOD, PERIOD) - 0.5 * PERIOD
    )
    earliest = np.quantile(offset[np.abs(offset) < 0.25 * PERIOD], 0.02)
    phase = np.maximum(np.mod(offset - earliest + EARLY, PERIOD) - EARLY, 0.0)
    due = round((t[-1] - t[0]) / PERIOD) + 1
    return np.concatenate([phase, np.full(max(0, due - len(t)), PERIOD)])
