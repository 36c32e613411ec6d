"""The budget of a period: how much all that the hand's own motion does not cause may do to a force.

Surfaces, gains, models and fades move a force that the hand has not moved. Each rule takes its part
of one budget before it acts, in the order in which the rules run, so that together they move the
force no faster than `EXTERNAL_RATE`. A rule that acts later may have a part reserved for it.
"""

from __future__ import annotations


class Budget:
    """What is left of the change of the force in one period [N]; never below zero.

    Fields:
        left: Change that no rule has taken yet [N].
    """

    __slots__ = ("left",)

    def __init__(self, amount: float) -> None:
        self.left = amount

    def take(self, wanted: float) -> float:
        """Take a part, as far as it is there; return the part [N].

        Args:
            wanted: Wanted change of the force, not negative [N].
        """
        granted = min(wanted, self.left)
        self.left -= granted
        return granted

    def reserve(self, fraction: float) -> float:
        """Reserve a fraction of the remaining budget for a later rule; return it [N].

        Args:
            fraction: From 0 to 1.
        """
        before = self.left
        self.left = before * (1.0 - fraction)
        return before - self.left
