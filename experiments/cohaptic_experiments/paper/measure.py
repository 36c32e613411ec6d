"""Measures of a recorded response: swing, settling time, and growth of an oscillation."""

from __future__ import annotations

import numpy as np

from cohaptic_server.numeric import Floats


def growth_per_tick(x: Floats, low: float, high: float) -> float:
    """Factor by which an alternating oscillation changes from tick to tick.

    A least-squares line through the logarithm of the steps |x_{k+1} - x_k|, which for a real root r
    of the loop go as |r|^k.

    Args:
        x: Positions after each tick, shape (n,) [m].
        low: Steps below it are rounding (patches carry 32 bits) [m].
        high: Steps above it are no longer of the linear loop [m].

    Returns:
        The factor; not a number when fewer than 8 steps in a row lie between `low` and `high`.
    """
    steps = np.abs(np.diff(x))
    inside = (steps > low) & (steps < high)
    first, length = _longest_run(inside)
    if length < 8:
        return float("nan")
    k = np.arange(first, first + length)
    return float(np.exp(np.polyfit(k, np.log(steps[k]), 1)[0]))


def settling_time(t: Floats, x: Floats, start: float, tolerance: float) -> float:
    """Time from `start` until `x` stays within `tolerance` of where it ends; infinite if never.

    Args:
        t: Shape (n,) [s].
        x: Shape (n,) [m].
        start: Start of the step [s].
        tolerance: Share of the final value.
    """
    tail = x[-max(1, len(x) // 10) :]
    final = float(tail.mean())
    if np.abs(tail - final).max() > tolerance * abs(final):
        return float("inf")
    outside = np.flatnonzero(np.abs(x - final) > tolerance * abs(final))
    return max(0.0, float(t[outside[-1]]) - start) if outside.size else 0.0


def swing(x: Floats) -> float:
    """Peak to peak [m]."""
    return float(np.ptp(x))


def _longest_run(inside: np.ndarray) -> tuple[int, int]:
    """Begin and length of the longest run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], inside.astype(int), [0]])))
    if not edges.size:
        return 0, 0
    begins, ends = edges[::2], edges[1::2]
    best = int((ends - begins).argmax())
    return int(begins[best]), int(ends[best] - begins[best])
