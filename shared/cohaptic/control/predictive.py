"""The predictive local model, science 3.3 and 3.8.

The server sends the surface free of this client's own force; the client solves its own contact at
the haptic rate. Its own force is not part of the delayed loop, so alone it is exact at any delay.

Its gain is the object's own stiffness, K_i = 1 / C_ii, or the device's limit where that is less;
no integral makes up for that limit, since such an integral generates energy (3.8).
"""

from __future__ import annotations


def predictive_force(depth_free: float, k_h: float) -> float:
    """Normal force f = K (x_h - x_free).

    Args:
        depth_free: Of the probe below the surface free of its own force [m].
        k_h: Gain K_i, at most 1 / C_ii [N/m].

    Returns:
        Force on the hand along the outward normal [N].
    """
    return k_h * depth_free if depth_free > 0.0 else 0.0
