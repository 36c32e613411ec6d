"""How much later than another force a force makes shares of its change.

Each share refers to the final change of the same force, so that a control law which loses a part of
the force does not count as late. The delay of half of the change is the largest delay of any level
up to half: with several hands a force may overshoot at first, because the answers of the others
come later, and would pass its own half early.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from cohaptic_server.numeric import Floats

LEAST = 0.05  # N; a smaller change is not perceived
LEVELS: Final = np.arange(1, 10) / 10.0  # shares of the change whose times are compared
_REST = 0.2  # s at both ends of a window; the change is the difference of the two mean forces
_SMOOTH = 11  # ms; width of a centred moving average of a recorded force


class Late(NamedTuple):
    """Delays of a force [s]; NaN if one of the two forces does not change.

    Args:
        onset: Delay of a tenth of the change.
        half: Largest delay of any level up to half of the change.
        limit: Largest delay of any level up to nine tenths of it.
    """

    onset: float
    half: float
    limit: float


UNKNOWN = Late(math.nan, math.nan, math.nan)


def late(felt: Floats, true: Floats) -> Late:
    """Return the delays of a force behind another one.

    Args:
        felt: Times at which the one force passes `LEVELS`, from `passed`, shape (9,) [s].
        true: The same of the other force, shape (9,) [s].
    """
    delays = felt - true
    return Late(float(delays[0]), float(delays[:5].max()), float(delays.max()))


def passed(t: Floats, force: Floats, least: float = LEAST) -> Floats:
    """Return when a force first passes each of `LEVELS` in a window around one press.

    Args:
        t: Times, evenly spaced, shape (n,) [s].
        force: Force at each time, shape (n,) [N].
        least: Change below which no time is known [N].

    Returns:
        Times, shape (9,) [s]; NaN where the force does not pass a level within the window.
    """
    width = max(1, round(1e-3 * _SMOOTH / float(t[1] - t[0]))) | 1
    padded = np.pad(force, width // 2, mode="edge")
    smooth = np.convolve(padded, np.full(width, 1.0 / width), mode="valid")
    start = float(smooth[t <= t[0] + _REST].mean())
    change = float(smooth[t >= t[-1] - _REST].mean()) - start
    if not abs(change) >= least:
        return np.full(len(LEVELS), math.nan)
    fraction = (smooth - start) / change
    return np.array([_first(t, fraction, float(level)) for level in LEVELS])


def _first(t: Floats, values: Floats, limit: float) -> float:
    """Return the time at which values first reach a limit, between two readings [s].

    The result is NaN if they never do, or begin there.
    """
    after = int(np.argmax(values >= limit))
    if after == 0:
        return math.nan
    a, b = values[after - 1], values[after]
    return float(t[after - 1] + (limit - a) / (b - a) * (t[after] - t[after - 1]))
