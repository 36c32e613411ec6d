"""The paper's proportional local model, section 3.

The law presses on the surface as the simulation returned it, own indentation included, so its own
force returns to it one round trip late: stable alone iff k_h < k_o (8), for every delay (science
3.1); with other contacts iff rho(|C| diag(k_h)) < 1 under any delay (3.2).
"""

from __future__ import annotations


def proportional_force(depth: float, k_h: float) -> float:
    """Normal force of L(z) = K_h.

    Args:
        depth: Of the probe below the surface as the simulation returned it, x_o [m].
        k_h: Gain [N/m]; stable alone iff k_h < k_o, eq. (8).

    Returns:
        Force on the hand along the outward normal [N].
    """
    return k_h * depth if depth > 0.0 else 0.0


def proportional_stiffness(k_h: float, c_ii: float) -> float:
    """Stiffness felt at the probe in steady state, by eq. (11).

    With x_o = K_h x_h / (K_h + K_o) the force is K_h (x_h - x_o) = K_h K_o x_h / (K_h + K_o).

    Args:
        k_h: Gain [N/m].
        c_ii: Compliance of the contact, 1 / K_o [m/N].
    """
    return k_h / (1.0 + k_h * c_ii)
