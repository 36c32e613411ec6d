"""Whether something grows, told from many looks at it: a line through them, and how sure it is.

The line is that of least squares, and its slope has an interval of confidence by Student's t, which
takes the looks' distances from the line for independent. What is said of the growth is said with
both ends of this interval: few looks, or looks that scatter, tell neither growth nor its absence,
and then nothing is claimed.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np
from scipy.stats import t as student

LEAST_LOOKS = 6  # of fewer the interval says nothing that anybody would go by

Verdict = Literal["steady", "grows", "cannot be told"]


class Trend(NamedTuple):
    """Growth from the first look to the last one, in the unit of what was looked at.

    Args:
        least: Lower end of the interval of confidence.
        likely: By the line itself.
        limit: Upper end of the interval.
    """

    least: float
    likely: float
    limit: float

    def verdict(self, limit: float) -> Verdict:
        """By a growth that would not matter: `steady` only where all of the interval is below."""
        if self.limit <= limit:
            return "steady"
        return "grows" if self.least > limit else "cannot be told"


def trend(times: Sequence[float], values: Sequence[float], confidence: float = 0.95) -> Trend:
    """Growth of `values` over `times`, shapes (n,), n >= LEAST_LOOKS.

    Args:
        times: Rising.
        confidence: Share of cases in which the interval holds the truth, 0 to 1.

    Raises:
        ValueError: There are too few looks.
    """
    if len(times) < LEAST_LOOKS:
        raise ValueError(f"{len(times)} looks are too few for a trend: at least {LEAST_LOOKS}")
    t, v = np.asarray(times, dtype=float), np.asarray(values, dtype=float)
    from_middle = t - t.mean()
    spread = float(from_middle @ from_middle)
    slope = float(from_middle @ v) / spread
    left = v - v.mean() - slope * from_middle
    error = float(np.sqrt(left @ left / (len(t) - 2) / spread))
    whole = float(t[-1] - t[0])
    half = float(student.ppf(0.5 + 0.5 * confidence, len(t) - 2)) * error
    return Trend(whole * (slope - half), whole * slope, whole * (slope + half))
