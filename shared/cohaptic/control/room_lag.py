"""The lag of a room with its stability margin, without numpy for the haptic loop's process."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final


# The class has its own `__init__`, which is compiled for the haptic loop, where patches arrive. The
# constructor of a named tuple is always interpreted, when no cache holds the interpreter's code.
@dataclass(init=False, unsafe_hash=True)
class RoomLag:
    """Lag, coupling and stability margin of a room (science 3.8, `lag_choice.choose_lag`).

    Fields:
        lag: Lag tau in use, 0 for none [s].
        coupling: Spectral radius m of the coupling matrix S; below 1 hands at rest need no lag.
        margin: Stability margin; above 1 hands at rest are stable, and without coupling it is
            infinite. If the server anticipates forces (3.13), the margin is the inverse of the
            factor by which a force error shrinks in one round trip. Otherwise it is tau over the
            least stable tau, or 1 / m for m < 1.
    """

    lag: Final[float]
    coupling: Final[float]
    margin: Final[float]

    def __init__(self, lag: float = 0.0, coupling: float = 0.0, margin: float = math.inf) -> None:
        self.lag = lag
        self.coupling = coupling
        self.margin = margin


NO_LAG = RoomLag()
