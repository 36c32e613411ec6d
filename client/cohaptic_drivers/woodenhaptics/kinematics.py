"""Pure functions from the counts of three encoders to the tip, and from its force to currents.

The chain is computed in the frame of CHAI3D: toward the user, the user's right, up. Results are in
the frame of cohaptic: right, away from the user, up. A Polhem v3 has a closed chain; its tip is
computed in the frame of CHAI3D, too, from its base.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from cohaptic.vec import Vec3, is_finite, scale, sub
from cohaptic_drivers.woodenhaptics.unit import Unit

# m; from the maintainers' host library of 2026
_L0, _L1, _L2, _L3, _L4, _L5 = 0.034, 0.165, 0.025, 0.190, 0.034, 0.1308
_STEP = 1e-5  # rad; step of finite differences: rounding and curvature both cost 1e-10 of a length


def polhem_position(angles: Vec3) -> Vec3 | None:
    """Return the position of a Polhem's tip [m]; None for angles at which the chain does not close.

    Args:
        angles: Angles of the three joints [rad].
    """
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
    except (ValueError, ZeroDivisionError):  # the argument of acos is outside -1 to 1
        return None
    r = _L0 / 2.0 + _L1 * math.cos(t2) + _L5 * math.cos(lam)
    return (r * math.cos(t1), r * math.sin(t1), _L1 * math.sin(t2) + _L5 * math.sin(lam))


def polhem_jacobian(angles: Vec3) -> tuple[Vec3, Vec3, Vec3] | None:
    """Return the Jacobian of a Polhem's tip [m/rad], a column per angle.

    The result is None close to angles at which the chain does not close.

    Args:
        angles: Angles of the three joints [rad].
    """
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


Columns = tuple[Vec3, Vec3, Vec3]


@dataclass(frozen=True, slots=True)
class Pose:
    """Position of an arm's tip and its Jacobian, at some joint angles.

    Args:
        position: Position of the tip [m].
        jacobian: Change of the position with each joint's angle [m/rad], a column per joint.
    """

    position: Vec3
    jacobian: Columns


def joint_angles(unit: Unit, counts: Vec3) -> Vec3:
    """Return the angles of the three joints [rad] for these counts of the encoders."""
    a, b, c = (
        unit.directions[i]
        * (2.0 * math.pi)
        * (counts[i] + unit.home[i])
        / unit.counts[i]
        * (unit.capstans[i] / unit.drums[i])
        for i in range(3)
    )
    return (a, b, c)


def pose_at(unit: Unit, angles: Vec3) -> Pose | None:
    """Return the pose for joint angles [rad]; None for angles that the arm cannot have."""
    if unit.kind == "polhem":
        position, jacobian = polhem_position(angles), polhem_jacobian(angles)
        if position is None or jacobian is None:
            return None
    else:
        position, jacobian = _serial_chain(unit.lengths, angles)
    x, y, z = (position[i] - unit.origin[i] for i in range(3))
    columns = (_to_user(jacobian[0]), _to_user(jacobian[1]), _to_user(jacobian[2]))
    return Pose(_to_user((x, y, z)), columns)


def motor_currents(unit: Unit, jacobian: Columns, force: Vec3) -> Vec3:
    """Return the motor currents [A] that apply `force` [N] at the tip.

    If one would exceed the unit's largest, all are scaled down alike: less force, same direction.
    """
    wanted = [
        sum(column[k] * force[k] for k in range(3))  # torque of the joint, J^T F
        * unit.directions[i]
        * (unit.capstans[i] / unit.drums[i])
        / unit.torque_constants[i]
        for i, column in enumerate(jacobian)
    ]
    largest = max(map(abs, wanted))
    fraction = min(1.0, unit.max_current / largest) if largest > 0.0 else 1.0
    a, b, c = (fraction * each for each in wanted)
    return (a, b, c) if is_finite((a, b, c)) else (0.0, 0.0, 0.0)


def resolution(unit: Unit) -> float:
    """Return the largest motion of the tip per count in the home pose [m].

    The result is 0 if the home pose of the unit's file is impossible.
    """
    pose = pose_at(unit, joint_angles(unit, (0.0, 0.0, 0.0)))
    if pose is None:
        return 0.0
    steps = [
        2.0 * math.pi / unit.counts[i] * unit.capstans[i] / unit.drums[i] * math.hypot(*column)
        for i, column in enumerate(pose.jacobian)
    ]
    return max(steps)


def _serial_chain(lengths: Vec3, angles: Vec3) -> tuple[Vec3, Columns]:
    """Return tip [m] and Jacobian [m/rad] of two links in a parallelogram on a turning base.

    The angles of both links are measured in the base.
    """
    base, upper, fore = lengths
    a, b, c = angles
    ca, sa, cb, sb, cc, sc = (
        math.cos(a), math.sin(a), math.cos(b), math.sin(b), math.cos(c), math.sin(c),
    )  # fmt: skip
    r = upper * sb + fore * sc
    position = (ca * r, sa * r, base + upper * cb - fore * cc)
    return position, (
        (-sa * r, ca * r, 0.0),
        (upper * ca * cb, upper * sa * cb, -upper * sb),
        (fore * ca * cc, fore * sa * cc, fore * sc),
    )


def _to_user(v: Vec3) -> Vec3:
    """Convert from (toward the user, right, up) to (right, away from the user, up)."""
    return (v[1], -v[0], v[2])
