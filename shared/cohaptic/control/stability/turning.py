"""Time constant T_g with which others may turn a contact (science 3.12).

A hand at depth d under a surface of curvature k answers the others' forces with two springs: K
along the normal, after the delay of its loop, and -K g along the surface, g = d k / (1 - d k),
since the nearest point to its probe turns with the surface. Let S contain both directions of every
contact, S_pp between the normals, S_pt from tangents to normals and S_tt between the tangents. With
the answers p along the normals and t along the tangents, the loop is

    p = -A (S_pp p + S_pt t),    A = diag(exp(-s T_i) / (1 + s tau)),
    t = B (S_tp p + S_tt t),     B = 1 / (1 + s T_g).

**Theorem.** Let mu be the largest eigenvalue of -S_pp, w > 0 with cos(w T) - w tau sin(w T) >= mu
for T = T_max, a = 1 / sqrt(1 + w^2 tau^2) and b = 1 / sqrt(1 + w^2 T_g^2). If the largest
eigenvalue of S_tt is below 1, all delays T_i <= T are stable if E^(1/2) S E^(1/2) has a norm below
1, with E = a for the normals and b for the tangents.

*Proof* in `docs/science.md`: below w the real parts of both springs are positive, above w the gain
of the loop is below one.
"""

from __future__ import annotations

import math

import numpy as np

from cohaptic.control.stability.single_contact import Floats

_BISECTIONS = 30  # gives frequency and share to 9 digits


def turning_needed(S: Floats, tangents: int, longest_delay: float, lag: float = 0.0) -> float:
    """Edge of the theorem [s]: every longer T_g is stable; infinite if no T_g is proved stable.

    Args:
        S: sqrt|N| C sqrt|N| of all contacts with their springs N (K or -K g), the tangents last,
            with zeros between directions of the same contact; symmetric, shape (n, n).
        tangents: Number of rows of S that are tangents.
        longest_delay: T_max [s].
        lag: tau of the room [s].
    """
    normals = len(S) - tangents
    if not tangents or not normals:
        return 0.0
    mu = max(0.0, -float(np.linalg.eigvalsh(S[:normals, :normals])[0]))
    if mu >= 1.0 or np.linalg.eigvalsh(S[normals:, normals:])[-1] >= 1.0:
        return math.inf
    w = _highest_passive(mu, longest_delay, lag)
    roots = np.full(len(S), 1.0 / math.hypot(1.0, w * lag) ** 0.5)

    def gain(b: float) -> float:
        roots[normals:] = math.sqrt(b)
        return float(np.abs(np.linalg.eigvalsh(S * roots[:, None] * roots)).max())

    if gain(1.0) < 1.0:
        return 0.0
    low, high = 0.0, 1.0
    for _ in range(_BISECTIONS):
        b = 0.5 * (low + high)
        low, high = (b, high) if gain(b) < 1.0 else (low, b)
    return math.sqrt(1.0 / (low * low) - 1.0) / w if low > 0.0 else math.inf


def _highest_passive(mu: float, delay: float, lag: float) -> float:
    """Highest frequency w with cos(w T) - w tau sin(w T) >= mu [rad/s]."""
    low, high = 0.0, math.acos(mu) / delay
    if lag == 0.0:
        return high
    for _ in range(_BISECTIONS):
        w = 0.5 * (low + high)
        passive = math.cos(w * delay) - w * lag * math.sin(w * delay) >= mu
        low, high = (w, high) if passive else (low, w)
    return low
