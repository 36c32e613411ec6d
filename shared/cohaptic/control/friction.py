"""Coulomb friction in the local model, in the plane of contact, with the full contact compliance.

The probe sticks to the surface, whose contact point gives way by the body's 3x3 compliance C; the
probe slides where the tangential force f_t would exceed mu times the normal force f_n. With the
outward unit normal n the hand gets f = n f_n + f_t and the body the opposite force, so the contact
point moves by -C f. While the contact sticks, the tip's displacement s along the surface equals
that of the contact point,

    s = -P C (n f_n + f_t),    P = I - n n',    hence    f_t = -(P C P)^-1 (s + P C n f_n),

and the tangential force changes the depth at which the normal force is balanced by n . C f_t. The
client computes all of this: no part of its own force comes back late (science 3.3). The anchor of
a sticking contact is a material point: other users may drag it, and the hand feels that (3.10).
"""

from __future__ import annotations

import math
from typing import NamedTuple

from cohaptic.vec import ZERO, Vec3, add, cross, dot, norm, scale, sub, unit

# Coefficient of friction, about that of rubber on dry glass; more is an error. Reasoned, not
# measured.
MAX_FRICTION = 2.0


class Compliance3(NamedTuple):
    """A symmetric 3x3 contact compliance in the world frame [m/N]."""

    xx: float
    yy: float
    zz: float
    xy: float
    xz: float
    yz: float


class FrictionState(NamedTuple):
    """State of friction at one contact after one haptic period.

    Fields:
        stretch: Displacement s of the tip over the material since the tip began to stick [m].
        force: Tangential force f_t on the hand [N].
        material: Displacement of the material under the contact that the other users cause, as far
            as the force has followed that displacement [m].
        touching: Whether there was contact in the last period.
        fraction: Ratio of the contact's stiffness to the body's; below 1 if the device is softer.
        stiffness: Stiffness of the contact in its stiffest direction along the surface [N/m].
        slips: Whether the tip slid over the material in the last period.
    """

    stretch: Vec3 = ZERO
    force: Vec3 = ZERO
    material: Vec3 = ZERO
    touching: bool = False
    fraction: float = 1.0
    stiffness: float = 0.0
    slips: bool = False


NO_FRICTION = FrictionState()


def times(C: Compliance3, f: Vec3) -> Vec3:
    """Return the displacement C f [m] of a contact with the compliance `C` under the force `f`."""
    return (
        C[0] * f[0] + C[3] * f[1] + C[4] * f[2],
        C[3] * f[0] + C[1] * f[1] + C[5] * f[2],
        C[4] * f[0] + C[5] * f[1] + C[2] * f[2],
    )


def is_definite(C: Compliance3) -> bool:
    """Return whether a compliance is positive definite, as a body's must be (Sylvester's rule)."""
    xx, yy, zz, xy = C[:4]
    if not (xx > 0.0 and yy > 0.0 and zz > 0.0):
        return False
    return xx * yy - xy * xy > _ROUNDING * xx * yy and _determinant(C) > _ROUNDING * xx * yy * zz


# Least ratio of a definite C's determinant to the product of its diagonal: above the rounding of
# the doubles in which it is computed, and below 2.7e-7, the least that the server sends with an
# eigenvalue of 1e-4 of the trace (`loads.MIN_EIGENVALUE_FRACTION`).
_ROUNDING = 1e-9


def least_eigenvalue(C: Compliance3) -> float:
    """Return a lower bound for the smallest eigenvalue of a positive definite C [m/N]."""
    # The product of the other two eigenvalues is at most the square of half the trace.
    return 4.0 * _determinant(C) / (C[0] + C[1] + C[2]) ** 2


def _determinant(C: Compliance3) -> float:
    xx, yy, zz, xy, xz, yz = C
    return xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz)


def tangents(normal: Vec3) -> tuple[Vec3, Vec3]:
    """Return two unit vectors that form an orthonormal frame with the unit vector `normal`."""
    helper: Vec3 = (1.0, 0.0, 0.0) if abs(normal[0]) < 0.7 else (0.0, 1.0, 0.0)
    one = unit(cross(normal, helper))
    return one, cross(normal, one)


def normal_shift(state: FrictionState, normal: Vec3, C: Compliance3) -> float:
    """Return n . C f_t, the change of the contact's depth that the tangential force causes [m].

    Args:
        normal: Outward unit normal n.
        C: Contact compliance.
    """
    return dot(normal, times(C, state.force))


def believed_shift(normal: Vec3, C: Compliance3, k_h: float) -> float:
    """Return the factor, above 0 and at most 1, by which a law multiplies `normal_shift`.

    The law answers the shift of its depth with K_h times as much force, friction answers that
    force, and so on period after period. With C_nn = n . C n this converges if K_h is at most
    1 / C_nn: in a sticking contact the compliance along the normal that acts through the tangent
    plane is less than C_nn (a Schur complement), and in a slipping contact `friction_step` ensures
    the same. The gain may be larger for a while, since normal, compliance and gain each follow the
    surface at their own rate. The factor then acts as if the gain were 1 / C_nn.

    Args:
        normal: Outward unit normal n in use.
        C: Contact compliance in use.
        k_h: Gain K_h in use [N/m].
    """
    gain = k_h * dot(normal, times(C, normal))
    return 1.0 if gain <= 1.0 else 1.0 / gain


def wedging(mu: float, normal: Vec3, C: Compliance3, k_h: float) -> float:
    """Return kappa, the part of a change of the normal force that friction feeds back, 0 to 0.9.

    A change of the normal force changes the friction force by at most mu times as much, and the
    friction force changes the depth; in the end the normal force changes by at most
    1 / (1 - kappa) times its first change.

    Args:
        mu: Coefficient of friction.
        normal: Outward unit normal in use.
        C: Contact compliance in use.
        k_h: Gain in use [N/m].
    """
    moved = times(C, normal)
    along = dot(moved, normal)
    lift = norm(sub(moved, scale(normal, along)))
    return min(_WEDGE, mu * lift * min(k_h, 1.0 / along) if along > 0.0 else _WEDGE)


def follow_material(state: FrictionState, material: Vec3, max_change: float) -> tuple[Vec3, Vec3]:
    """Compute how far the anchor follows the material that other users displace (science 3.10).

    Args:
        state: State after the last period.
        material: Present displacement of the material that the other users cause [m].
        max_change: Largest displacement of the anchor in this period, so that the force of a
            contact at rest has no step [m].

    Returns:
        Displacement of the anchor in this period, and the part of `material` that the anchor has
        followed so far [m].
    """
    if not state.touching:
        return ZERO, material
    gap = sub(material, state.material)
    size = norm(gap)
    if size > max_change:
        gap = scale(gap, max_change / size)
    return gap, add(state.material, gap)


def anchor_of(state: FrictionState, probe: Vec3, normal: Vec3, depth: float) -> Vec3 | None:
    """Return the anchor, the point of the resting surface that the contact holds [m].

    The anchor is the tip, moved back by the tip's displacement over the material, out along the
    normal to the surface, and back by the material's displacement. While the contact sticks, the
    anchor does not move, even if normal, compliance or force change. A server that places the
    contact at the anchor therefore does not react to the values that it sent (science 3.10).

    Args:
        state: State after the period.
        probe: Tip of the device [m].
        normal: Outward unit normal in use.
        depth: Depth of the tip below the surface in use [m].

    Returns:
        Position of the anchor [m]; None if the state has no contact with friction.
    """
    if not state.touching:
        return None
    on_surface = add(sub(probe, state.stretch), scale(normal, max(0.0, depth)))
    return sub(on_surface, state.material)


# Above 60 lines: the steps share a dozen scalars, and a call costs a part of the haptic period.
def friction_step(
    state: FrictionState,
    moved: Vec3,
    material: Vec3,
    normal: Vec3,
    normal_force: float,
    C: Compliance3,
    mu: float,
    fraction: float,
    max_stiffness: float,
    max_change: float,
) -> FrictionState:
    """Compute the next period of Coulomb friction: stick or slip, with the full compliance.

    Args:
        state: State after the last period.
        moved: Displacement of the tip in this period [m].
        material: Displacement of the material under the contact that the other users cause [m].
        normal: Outward unit normal at the contact.
        normal_force: Normal force f_n on the hand [N]; 0 ends the contact.
        C: Contact compliance [m/N].
        mu: Coefficient of friction.
        fraction: Ratio of the law's stiffness to the body's, K_h C_ii (science 3.3).
        max_stiffness: Largest stiffness that the device renders stably, applied to every tangential
            direction [N/m].
        max_change: Largest change of the friction force that other users may cause in this period
            [N].

    Returns:
        State after this period; `NO_FRICTION` without contact.
    """
    if normal_force <= 0.0 or mu <= 0.0 or fraction <= 0.0:
        return NO_FRICTION
    one, two = tangents(normal)
    along_n = times(C, scale(normal, normal_force))
    b1, b2 = dot(along_n, one), dot(along_n, two)
    c1 = times(C, one)
    c11, c12, c22 = dot(c1, one), dot(c1, two), dot(times(C, two), two)
    det = c11 * c22 - c12 * c12
    if c11 <= 0.0 or det <= 0.0:  # not the compliance of an elastic body
        return NO_FRICTION
    # If friction lifted the contact point faster than the finger presses it in, the contact would
    # wedge, and its force would grow without bound.
    lifts = math.hypot(b1, b2)
    if mu * lifts > _WEDGE * dot(along_n, normal):
        mu = _WEDGE * dot(along_n, normal) / lifts
    # Compliance of the stiffest direction, computed from the larger eigenvalue to avoid
    # cancellation.
    stiffest = det / (0.5 * (c11 + c22) + math.hypot(0.5 * (c11 - c22), c12))
    fraction = min(fraction, max_stiffness * stiffest)
    held = norm(state.force)
    if state.touching and held > 0.0:
        # A change of the gain also changes the friction force, by at most half of `max_change`.
        reach = 0.5 * max_change / held
        fraction = min(
            max(fraction, state.fraction * (1.0 - reach)), state.fraction * (1.0 + reach)
        )
        # A value below 0, even by rounding, would make the anchor follow the material backwards.
        max_change = max(0.0, max_change - held * abs(fraction / state.fraction - 1.0))
    carried, followed = follow_material(state, material, max_change * stiffest / fraction)
    stretch = state.stretch
    if not state.touching:
        # Friction starts from zero: the tip did not stick while the normal force began.
        stretch = add(scale(one, -b1), scale(two, -b2))
    way = sub(add(stretch, moved), carried)
    # Coordinates in the present tangent plane, since the surface turns under the tip.
    s1, s2 = dot(way, one), dot(way, two)
    r1, r2 = s1 + b1, s2 + b2
    f1 = -fraction * (c22 * r1 - c12 * r2) / det
    f2 = -fraction * (c11 * r2 - c12 * r1) / det
    size, limit = math.hypot(f1, f2), mu * normal_force
    if size > limit:
        # Slip: the contact point follows the tip until the limited friction can hold it.
        f1, f2 = f1 * limit / size, f2 * limit / size
        s1 = -(c11 * f1 + c12 * f2) / fraction - b1
        s2 = -(c12 * f1 + c22 * f2) / fraction - b2
    stretch = add(scale(one, s1), scale(two, s2))
    force = add(scale(one, f1), scale(two, f2))
    return FrictionState(
        stretch, force, followed, True, fraction, fraction / stiffest, size > limit
    )


# Largest part, as a ratio, of the normal force's indentation that friction may cancel along the
# normal; at 1 the contact point would no longer give way under the finger, and would wedge (science
# 3.10). The tenth that is left is as that of `gains.ALPHA`. Reasoned, not measured.
_WEDGE = 0.9


def tangential(force: Vec3, normal: Vec3, normal_force: float) -> Vec3:
    """Return the tangential part of a force, limited to `MAX_FRICTION` times the normal force [N].

    Args:
        force: Force on the hand or on the body [N].
        normal: Unit normal of the surface.
        normal_force: Magnitude of the normal force [N].
    """
    along = sub(force, scale(normal, dot(force, normal)))
    size, limit = norm(along), MAX_FRICTION * max(0.0, normal_force)
    return scale(along, limit / size) if size > limit else along
