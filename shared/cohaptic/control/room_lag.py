"""The lag of a room as a value; without numpy, since the haptic loop's process reads it too."""

from __future__ import annotations

import math
from typing import NamedTuple


class RoomLag(NamedTuple):
    """A room's coupling, and the lag in use (science 3.8, `stability.lag_choice.choose_lag`).

    Fields:
        lag: tau in use, 0 for none [s].
        coupling: m, spectral radius of S; below 1 hands at rest are stable at any delay.
        margin: Distance from the edge of the theorem: tau over the least stable one, and 1 / m for
            m < 1. Above 1 the room is stable; infinite for hands that do not couple.
    """

    lag: float = 0.0
    coupling: float = 0.0
    margin: float = math.inf


NO_LAG = RoomLag()
