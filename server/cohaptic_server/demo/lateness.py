"""How late a force is felt: by its half change, beside what it would be without a network."""

from __future__ import annotations

import math

import numpy as np

from cohaptic_server.numeric import Floats

LEAST = 0.05  # N; a change that is less is not felt
_REST = 0.2  # s at either end of a window, from which the change is taken
_SMOOTH = 11  # ms over which a recorded force is averaged, as far before as after


def felt_delay(t: Floats, felt: Floats, at_once_t: Floats, at_once: Floats) -> float:
    """How much later `felt` has made half of its change than `at_once` has [s].

    Each is measured by its own change, so that a law which loses most of a force is not late for
    that. NaN where either changes by less than `LEAST`.

    Args:
        t: Of a window round one press, evenly spaced, shape (n,) [s].
        felt: Force that a hand had of the others, shape (n,) [N].
        at_once_t: Rising, shape (m,) [s].
        at_once: Force that it would have had without a network, shape (m,) [N].
    """
    width = max(1, round(1e-3 * _SMOOTH / float(t[1] - t[0]))) | 1
    padded = np.pad(felt, width // 2, mode="edge")
    smooth = np.convolve(padded, np.full(width, 1.0 / width), mode="valid")
    return half_change(t, smooth) - half_change(at_once_t, at_once)


def half_change(t: Floats, force: Floats) -> float:
    """When a force has made half of its change from the start to the end of a window [s].

    NaN where it changes by less than `LEAST`.

    Args:
        t: Rising, shape (n,) [s].
        force: Shape (n,) [N].
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
