"""From counts of three encoders to the tip, and from a force on it to currents. Pure.

The chain's own frame is that of CHAI3D: toward the user, the user's right, up. Results are in that
of cohaptic: right, away from the user, up.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from cohaptic.vec import Vec3, is_finite
from cohaptic_drivers.woodenhaptics.polhem import polhem_jacobian, polhem_position
from cohaptic_drivers.woodenhaptics.unit import Unit

Columns = tuple[Vec3, Vec3, Vec3]


@dataclass(frozen=True, slots=True)
class Pose:
    """An arm at some counts.

    Args:
        position: Of the tip [m].
        jacobian: Its change with each joint's angle [m/rad], by columns.
    """

    position: Vec3
    jacobian: Columns


def joint_angles(unit: Unit, counts: Vec3) -> Vec3:
    """Angles of the bodies [rad] for counts of the encoders."""
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
    """Tip and Jacobian; None for angles that the arm cannot have."""
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
    """Currents [A] that push with `force` [N], all scaled down together where one would be above
    the unit's limit: less force, in the same direction.
    """
    wanted = [
        sum(column[k] * force[k] for k in range(3))  # torque of the joint, J^T F
        * unit.directions[i]
        * (unit.capstans[i] / unit.drums[i])
        / unit.torque_constants[i]
        for i, column in enumerate(jacobian)
    ]
    most = max(map(abs, wanted))
    share = min(1.0, unit.max_current / most) if most > 0.0 else 1.0
    a, b, c = (share * each for each in wanted)
    return (a, b, c) if is_finite((a, b, c)) else (0.0, 0.0, 0.0)


def resolution(unit: Unit) -> float:
    """Largest way of the tip for one count in the home pose [m]; 0 where that is no pose."""
    pose = pose_at(unit, joint_angles(unit, (0.0, 0.0, 0.0)))
    if pose is None:
        return 0.0
    steps = [
        2.0 * math.pi / unit.counts[i] * unit.capstans[i] / unit.drums[i] * math.hypot(*column)
        for i, column in enumerate(pose.jacobian)
    ]
    return max(steps)


def _serial_chain(lengths: Vec3, angles: Vec3) -> tuple[Vec3, Columns]:
    """Two links in a parallelogram on a turning base: both angles are measured in the base."""
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
    """Right, away from the user, up, of toward the user, right, up."""
    return (v[1], -v[0], v[2])
