"""The predictive law (science 3.3 and 3.8): a spring on the surface without the own dent.

The server sends the free surface, without the dent of this client's own force, and the client
solves its own contact at the haptic rate. The client's own force is not part of the delayed loop,
so the force on a single hand is exact at any delay. The gain is the object's own stiffness,
K_i = 1 / C_ii, at any delay and with any other hands: the room's lag keeps several hands stable,
and no gain is lowered because of other hands. A softer device's limit takes its place; no integral
makes up for that limit, since such an integral generates energy (3.8).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from cohaptic.control.geometry import Sight
from cohaptic.control.laws.model import (
    DEFAULT_SETTINGS,
    Gains,
    LawSettings,
    LocalForce,
    LocalModel,
    depth_alone,
)


class Predictive(LocalModel):
    """Gain times depth below the free surface, at once and without memory."""

    def __init__(self) -> None:
        super().__init__(answers_own_dent=False, integrates=False)

    def force(
        self,
        memory: object,
        sight: Sight,
        gains: Gains,
        dt: float,
        settings: LawSettings = DEFAULT_SETTINGS,
        moved_in: float = 0.0,
        limit: float = math.inf,
    ) -> tuple[object, LocalForce]:
        """Compute the force of one period, K_i times the depth."""
        depth, k_h = sight.depth, gains.k_h
        f = predictive_force(depth, k_h)
        from_others = f - k_h * depth_alone(sight)
        return memory, LocalForce(f, from_others, sight.c_ii * f, 0.5 * f * depth)

    def felt_stiffness(self, k_h: float, k_o: float) -> float:
        """Return the object's stiffness, or the device's limit [N/m]."""
        return min(k_h, k_o)

    def gains(
        self,
        row: Sequence[float],
        i: int,
        max_stiffness: float,
        loop_delay: float,
        simulation_period: float,
        alpha: float,
    ) -> Gains:
        """Choose K_i = 1 / C_ii, or the device's limit."""
        return Gains(min(1.0 / row[i], max_stiffness))


def predictive_force(depth_free: float, k_h: float) -> float:
    """Return the normal force of the predictive law, the gain times the depth; 0 outside [N].

    Args:
        depth_free: Depth of the probe below the hand's free surface, x_h - x_free [m].
        k_h: Gain K_i, at most the object's own stiffness 1 / C_ii [N/m].

    Returns:
        Force on the hand along the outward normal [N].
    """
    return k_h * depth_free if depth_free > 0.0 else 0.0
