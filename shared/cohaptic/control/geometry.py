"""The local surface that a client holds between patches, and how deep a probe is in it.

Plane and sphere (Adachi 1995, as section 6 step 1 proposes). The surface is free of the client's
own force (science 3.3), so a change of patch never moves the force by itself.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from cohaptic.vec import Vec3, dot, lerp, sub, unit


@dataclass(frozen=True, slots=True)
class LocalSurface:
    """The part of a patch that a law needs.

    Args:
        x_free: Contact point without this client's own force [m].
        normal: Outward unit normal.
        curvature: 0 for a plane, 1/radius for a sphere that bulges towards the hand [1/m].
        c_ii: Compliance of the contact [m/N].
        own_force: Own normal force that the body carries at the patch's tick [N].
        u_others: Displacement of the point by the others, along the normal [m].
    """

    x_free: Vec3
    normal: Vec3
    curvature: float
    c_ii: float
    own_force: float
    u_others: float


def depth(surface: LocalSurface, probe: Vec3) -> float:
    """Distance of a probe below the surface [m]; negative outside.

    On a sphere of curvature c the point at height h over the tangent plane and at distance r from
    its axis is below the surface by (1 - |1 - c q|) / c, with |1 - c q| the scaled distance from
    the centre; written so that c = 0 gives the plane.
    """
    out = sub(probe, surface.x_free)
    height = dot(out, surface.normal)
    c = surface.curvature
    if c == 0.0:
        return -height
    # |out + normal / c| = s / c with s^2 = 1 + 2 c height + c^2 |out|^2
    s = math.sqrt(max(0.0, 1.0 + 2.0 * c * height + c * c * dot(out, out)))
    # (1 - s) / c without cancellation as c -> 0
    return -(2.0 * height + c * dot(out, out)) / (1.0 + s)


def normal_at(surface: LocalSurface, probe: Vec3) -> Vec3:
    """Outward normal of the local surface at the foot of a probe."""
    c = surface.curvature
    if c == 0.0:
        return surface.normal
    radial = sub(probe, surface.x_free)
    v = (
        surface.normal[0] + c * radial[0],
        surface.normal[1] + c * radial[1],
        surface.normal[2] + c * radial[2],
    )
    return unit(v, surface.normal)


def blend(a: LocalSurface, b: LocalSurface, s: float) -> LocalSurface:
    """Surface between a (s = 0) and b (s = 1): patches follow each other without a step."""
    if s >= 1.0:
        return b
    if s <= 0.0:
        return a
    return LocalSurface(
        lerp(a.x_free, b.x_free, s),
        unit(lerp(a.normal, b.normal, s), b.normal),
        a.curvature + s * (b.curvature - a.curvature),
        a.c_ii + s * (b.c_ii - a.c_ii),
        a.own_force + s * (b.own_force - a.own_force),
        a.u_others + s * (b.u_others - a.u_others),
    )
