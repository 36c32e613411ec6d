"""The closed chain of a Polhem v3, in the frame of CHAI3D from its base. Pure."""

from __future__ import annotations

import math

from cohaptic.vec import Vec3, scale, sub

# m; of the maintainers' host library of 2026
_L0, _L1, _L2, _L3, _L4, _L5 = 0.034, 0.165, 0.025, 0.190, 0.034, 0.1308
_STEP = 1e-5  # rad; of the differences, where rounding and curvature both cost 1e-10 of a length


def polhem_position(angles: Vec3) -> Vec3 | None:
    """Point of the tip [m]; None for angles at which the chain does not close."""
    t1, t2, t3 = angles
    a, s = _L0 + _L1 * math.cos(t2), _L1 * math.sin(t2)
    u, w = a - _L2 * math.cos(t3), s - _L2 * math.sin(t3)
    d1, d2 = math.hypot(a, s), math.hypot(u, w)
    try:
        lam = (
            t2
            - math.acos((_L1**2 - _L0**2 + d1**2) / (2.0 * _L1 * d1))
            - math.acos((_L4**2 - _L3**2 + d2**2) / (2.0 * _L4 * d2))
            - math.acos((d1**2 + d2**2 - _L2**2) / (2.0 * d1 * d2))
        )
    except (ValueError, ZeroDivisionError):  # of acos, beyond -1 to 1
        return None
    r = _L0 / 2.0 + _L1 * math.cos(t2) + _L5 * math.cos(lam)
    return (r * math.cos(t1), r * math.sin(t1), _L1 * math.sin(t2) + _L5 * math.sin(lam))


def polhem_jacobian(angles: Vec3) -> tuple[Vec3, Vec3, Vec3] | None:
    """Change of the tip with each angle [m/rad], by columns; None as `polhem_position`."""
    columns: list[Vec3] = []
    for i in range(3):
        low, high = list(angles), list(angles)
        low[i], high[i] = low[i] - _STEP, high[i] + _STEP
        before = polhem_position((low[0], low[1], low[2]))
        after = polhem_position((high[0], high[1], high[2]))
        if before is None or after is None:
            return None
        columns.append(scale(sub(after, before), 0.5 / _STEP))
    return (columns[0], columns[1], columns[2])
