"""What a room says of its time, as a value without numpy: the loop's process reads it, too."""

from __future__ import annotations

import math
from typing import NamedTuple


class RoomLag(NamedTuple):
    """What a room's coupling asks for, and what it gets (science 3.8, `room_lag.choose_lag`).

    Fields:
        lag: tau in use, 0 for none [s].
        coupling: m, spectral radius of S; below 1 no delay can make hands at rest swing.
        margin: How far the room is from the edge of the theorem: tau over the least that is stable,
            and 1 / m for m < 1. Above 1 it is stable; infinite for hands that do not couple.
    """

    lag: float = 0.0
    coupling: float = 0.0
    margin: float = math.inf


NO_LAG = RoomLag()
