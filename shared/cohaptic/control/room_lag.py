"""The lag of a room as a value; without numpy, since the haptic loop's process reads it too."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final


# With an `__init__` of its own, which is compiled where a patch arrives in the haptic loop: that of
# a named tuple is always interpreted, and finds the interpreter's code in no cache.
@dataclass(init=False, unsafe_hash=True)
class RoomLag:
    """A room's coupling, and the lag in use (science 3.8, `stability.lag_choice.choose_lag`).

    Fields:
        lag: tau in use, 0 for none [s].
        coupling: m, spectral radius of S; below 1 hands at rest need no lag.
        margin: Above 1 hands at rest are stable; infinite for those that do not couple. If forces
            are anticipated (3.13), 1 over the share of an error that is left after one way round;
            else tau over the least stable one, and 1 / m for m < 1.
    """

    lag: Final[float]
    coupling: Final[float]
    margin: Final[float]

    def __init__(self, lag: float = 0.0, coupling: float = 0.0, margin: float = math.inf) -> None:
        self.lag = lag
        self.coupling = coupling
        self.margin = margin


NO_LAG = RoomLag()
