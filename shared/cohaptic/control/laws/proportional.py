"""The paper's proportional law (section 3): a spring on the surface as the simulation returned it.

That surface includes the client's own dent, so the client's own force returns one round trip late.
A single hand is stable iff its gain k_h is below the object's stiffness k_o, eq. (8), at every
delay (science 3.1); several hands with the compliance matrix C are stable under any bounded delay
iff the spectral radius rho(|C| diag(k_h)) is below 1 (3.2; Chazan and Miranker 1969). A row sum
bounds that radius: K_h,i < 1 / sum_j |C_ij| is safe, and needs only the client's own row of C.
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
    coupled_stiffness,
    dented_depth,
    depth_alone,
)


class Proportional(LocalModel):
    """Gain times depth below the dented surface, without memory."""

    def __init__(self) -> None:
        super().__init__(answers_own_dent=True, integrates=False)

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
        """Compute the force of one period, K_h times the depth."""
        depth, k_h = dented_depth(sight), gains.k_h
        f = proportional_force(depth, k_h)
        stored = 0.5 * k_h * depth * depth if depth > 0.0 else 0.0
        from_others = f - proportional_stiffness(k_h, sight.c_ii) * depth_alone(sight)
        return memory, LocalForce(f, from_others, sight.c_ii * f, stored)

    def felt_stiffness(self, k_h: float, k_o: float) -> float:
        """Return the stiffness of gain and object in a row, eq. (11) [N/m]."""
        return k_h * k_o / (k_h + k_o)

    def gains(
        self,
        row: Sequence[float],
        i: int,
        max_stiffness: float,
        loop_delay: float,
        simulation_period: float,
        alpha: float,
    ) -> Gains:
        """Choose a fraction alpha of the bound, which holds at any delay."""
        return Gains(min(alpha * coupled_stiffness(row), max_stiffness))


def proportional_force(depth: float, k_h: float) -> float:
    """Return the normal force of the proportional law, the gain times the depth; 0 outside [N].

    Args:
        depth: Depth of the probe below the surface as the simulation returned it, x_h - x_o [m].
        k_h: Gain K_h [N/m]; a single hand is stable iff k_h < 1 / C_ii, eq. (8).

    Returns:
        Force on the hand along the outward normal [N].
    """
    return k_h * depth if depth > 0.0 else 0.0


def proportional_stiffness(k_h: float, c_ii: float) -> float:
    """Return the stiffness that a hand with the proportional law feels in the steady state [N/m].

    If the probe is x_h deep, the surface yields to x_o = K_h x_h / (K_h + K_o), eq. (11), and the
    force is K_h (x_h - x_o) = K_h K_o x_h / (K_h + K_o).

    Args:
        k_h: Gain K_h [N/m].
        c_ii: Compliance of the contact, 1 / K_o [m/N].
    """
    return k_h / (1.0 + k_h * c_ii)
