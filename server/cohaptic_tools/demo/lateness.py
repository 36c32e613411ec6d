"""Measures the delay of a force, relative to the force that would act without a network.

The delay is taken where each force has made half of its change.
"""

from __future__ import annotations

import math

import numpy as np

from cohaptic_server.numeric import Floats

LEAST = 0.05  # N; a smaller change is not perceived
_REST = 0.2  # s at both ends of a window; the change is the difference of the two mean forces
_SMOOTH = 11  # ms; width of a centred moving average of a recorded force


def felt_delay(t: Floats, felt: Floats, at_once_t: Floats, at_once: Floats) -> float:
    """Return the time from half of the change of `at_once` to half of the change of `felt` [s].

    Each half refers to the change of the same force, so that a control law which loses a part of
    the force does not count as late. The result is NaN if either force changes by less than
    `LEAST`.

    Args:
        t: Times of a window around one press, evenly spaced, shape (n,) [s].
        felt: Measured force that the other hands cause on a hand, shape (n,) [N].
        at_once_t: Increasing times, shape (m,) [s].
        at_once: Force that the other hands would cause without a network, shape (m,) [N].
    """
    width = max(1, round(1e-3 * _SMOOTH / float(t[1] - t[0]))) | 1
    padded = np.pad(felt, width // 2, mode="edge")
    smooth = np.convolve(padded, np.full(width, 1.0 / width), mode="valid")
    return half_change(t, smooth) - half_change(at_once_t, at_once)


def half_change(t: Floats, force: Floats) -> float:
    """Return the time at which a force has made half of its change in a window [s].

    The result is NaN if the force changes by less than `LEAST`, or has already made half of its
    change at the first sample.

    Args:
        t: Increasing times, shape (n,) [s].
        force: Force at each time, shape (n,) [N].
    """
    start = float(force[t <= t[0] + _REST].mean())
    change = float(force[t >= t[-1] - _REST].mean()) - start
    if not abs(change) >= LEAST:
        return math.nan
    share = (force - start) / change
    after = int(np.argmax(share >= 0.5))
    if after == 0:
        return math.nan
    a, b = share[after - 1], share[after]
    return float(t[after - 1] + (0.5 - a) / (b - a) * (t[after] - t[after - 1]))
