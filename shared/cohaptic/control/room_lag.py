"""The lag of a room as a value. No numpy here: the haptic loop's process uses this module, too."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final


# The class has its own `__init__`, which is compiled for the haptic loop, where patches arrive. The
# constructor of a named tuple is always interpreted, when no cache holds the interpreter's code.
@dataclass(init=False, unsafe_hash=True)
class RoomLag:
    """A room's lag in use, coupling and margin (science 3.8, `stability.lag_choice.choose_lag`).

    Fields:
        lag: Lag tau in use, 0 for none [s].
        coupling: m, spectral radius of S; below 1 hands at rest need no lag.
        margin: Stability margin; above 1 hands at rest are stable, infinite for hands that do not
            couple. If forces are anticipated (3.13), 1 over the share of a force error that is left
            after one round trip; else tau over the least stable tau, or 1 / m for m < 1.
    """

    lag: Final[float]
    coupling: Final[float]
    margin: Final[float]

    def __init__(self, lag: float = 0.0, coupling: float = 0.0, margin: float = math.inf) -> None:
        self.lag = lag
        self.coupling = coupling
        self.margin = margin


NO_LAG = RoomLag()
