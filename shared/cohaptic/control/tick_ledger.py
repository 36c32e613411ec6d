"""What the server's tick made of the force of one user, without numpy for the haptic loop."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final


# The class has its own `__init__` for the reason of `RoomLag`.
@dataclass(init=False, unsafe_hash=True)
class TickLedger:
    """Entries of one tick; what its stages took from a force is negative.

    The force along the contact's normal that the server had heard of, with the first five entries,
    is the force that the body carries.

    Fields:
        by_presence: Of a user who comes, leaves, is silent, has jumped to another contact, or is
            too high above the surface [N].
        by_limit: By the limits of the contact and of the body [N].
        by_anticipation: Since the answers of the other hands are anticipated [N].
        by_lag: By the room's lag [N].
        by_rate: Since the force on another hand would change too fast [N].
        gain_cut: What the gain of the user's law is less since others' models stiffen the
            contact [N/m].
    """

    by_presence: Final[float]
    by_limit: Final[float]
    by_anticipation: Final[float]
    by_lag: Final[float]
    by_rate: Final[float]
    gain_cut: Final[float]

    def __init__(
        self,
        by_presence: float = 0.0,
        by_limit: float = 0.0,
        by_anticipation: float = 0.0,
        by_lag: float = 0.0,
        by_rate: float = 0.0,
        gain_cut: float = 0.0,
    ) -> None:
        self.by_presence = by_presence
        self.by_limit = by_limit
        self.by_anticipation = by_anticipation
        self.by_lag = by_lag
        self.by_rate = by_rate
        self.gain_cut = gain_cut

    @property
    def entries(self) -> tuple[float, float, float, float, float]:
        """The five entries in newtons, in the order of the stages."""
        return (
            self.by_presence, self.by_limit, self.by_anticipation, self.by_lag, self.by_rate,
        )  # fmt: skip


NOTHING_CUT = TickLedger()
