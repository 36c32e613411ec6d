"""Coulomb friction at the local model, in the plane of contact, with the full contact compliance.

The probe sticks to the surface, whose contact point gives way by the body's 3x3 compliance C; where
the tangential force would exceed mu times the normal one it slides. The hand gets f = n f_n + f_t
and the body its opposite, so the contact point moves by -C f. While it sticks the tip's way s along
the surface is the contact point's,

    s = -P C (n f_n + f_t),    P = I - n n',    hence    f_t = -(P C P)^-1 (s + P C n f_n),

and the tangential force changes the depth at which the normal one is balanced, by n . C f_t.
Everything is local: nothing of the own force comes back late (science 3.3).
"""

from __future__ import annotations

import math
from typing import NamedTuple

from cohaptic.vec import ZERO, Vec3, add, cross, dot, norm, scale, sub, unit

MAX_FRICTION = 2.0  # rubber on dry glass; more is a mistake


class Compliance3(NamedTuple):
    """A symmetric 3x3 contact compliance in the world frame [m/N]."""

    xx: float
    yy: float
    zz: float
    xy: float
    xz: float
    yz: float

    def times(self, f: Vec3) -> Vec3:
        """C f [m]."""
        return (
            self.xx * f[0] + self.xy * f[1] + self.xz * f[2],
            self.xy * f[0] + self.yy * f[1] + self.yz * f[2],
            self.xz * f[0] + self.yz * f[1] + self.zz * f[2],
        )


class FrictionState(NamedTuple):
    """Memory of the sticking contact.

    Fields:
        stretch: s, the way of the tip along the surface since it stuck [m].
        force: f_t on the hand [N].
    """

    stretch: Vec3 = ZERO
    force: Vec3 = ZERO


def tangents(normal: Vec3) -> tuple[Vec3, Vec3]:
    """Two unit vectors that make a right-handed frame with `normal`."""
    helper: Vec3 = (1.0, 0.0, 0.0) if abs(normal[0]) < 0.7 else (0.0, 1.0, 0.0)
    one = unit(cross(normal, helper))
    return one, cross(normal, one)


def normal_shift(state: FrictionState, normal: Vec3, C: Compliance3) -> float:
    """By how much the tangential force takes the contact point away from the tip, n . C f_t [m]."""
    return dot(normal, C.times(state.force))


def friction_step(
    state: FrictionState,
    moved: Vec3,
    normal: Vec3,
    normal_force: float,
    C: Compliance3,
    mu: float,
    share: float = 1.0,
) -> FrictionState:
    """One period of stick and slip.

    Args:
        state: After the last period.
        moved: Way of the tip in this period [m].
        normal: Outward unit normal at the contact.
        normal_force: f_n on the hand [N]; 0 lets go.
        C: Contact compliance.
        mu: Coefficient of friction.
        share: Of the body's stiffness that the law may use, K_h C_ii (science 3.3).
    """
    if normal_force <= 0.0 or mu <= 0.0:
        return FrictionState()
    way = add(state.stretch, moved)
    one, two = tangents(normal)
    # As coordinates in the tangent plane: the surface turns under the tip.
    s1, s2 = dot(way, one), dot(way, two)
    along_n = C.times(scale(normal, normal_force))
    b1, b2 = dot(along_n, one), dot(along_n, two)
    c1 = C.times(one)
    c11, c12, c22 = dot(c1, one), dot(c1, two), dot(C.times(two), two)
    det = c11 * c22 - c12 * c12
    if det <= 0.0:
        return FrictionState()
    r1, r2 = s1 + b1, s2 + b2
    f1 = -share * (c22 * r1 - c12 * r2) / det
    f2 = -share * (c11 * r2 - c12 * r1) / det
    size, limit = math.hypot(f1, f2), mu * normal_force
    if size > limit:
        # Slip: the contact follows until the friction that is left can hold it.
        f1, f2 = f1 * limit / size, f2 * limit / size
        s1 = -(c11 * f1 + c12 * f2) / share - b1
        s2 = -(c12 * f1 + c22 * f2) / share - b2
    return FrictionState(add(scale(one, s1), scale(two, s2)), add(scale(one, f1), scale(two, f2)))


def tangential(force: Vec3, normal: Vec3, normal_force: float) -> Vec3:
    """The part of a force along the surface, cut to what friction can be [N]."""
    along = sub(force, scale(normal, dot(force, normal)))
    size, limit = norm(along), MAX_FRICTION * max(0.0, normal_force)
    return scale(along, limit / size) if size > limit else along
