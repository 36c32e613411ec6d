"""The local surface that a client keeps between patches, and the surface's evaluation at a probe.

This module has plane and sphere (Adachi 1995, as section 6 step 1 proposes); `mesh_surface.py` has
the mesh. Each is the client's free surface, without the dent of its own force (science 3.3), so a
new patch alone never changes the force. A law receives every geometry as a `Sight`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from cohaptic.vec import ZERO, Vec3, add, dot, lerp, sub, unit


@dataclass(init=False)
class Sight:
    """A local surface as evaluated at one probe, with the numbers that a law needs.

    Fields:
        depth: Depth of the probe below the surface, negative outside [m].
        normal: Outward unit normal at the foot of the probe.
        c_ii: Compliance of a contact at that foot [m/N].
        own_force: Force on this hand whose opposite acted on the body at the patch's tick [N].
        u_others: Displacement of the material under the contact that the other users cause [m].
    """

    depth: Final[float]
    normal: Final[Vec3]
    c_ii: Final[float]
    own_force: Final[Vec3]
    u_others: Final[Vec3]

    def __init__(
        self, depth: float, normal: Vec3, c_ii: float, own_force: Vec3, u_others: Vec3
    ) -> None:
        self.depth = depth
        self.normal = normal
        self.c_ii = c_ii
        self.own_force = own_force
        self.u_others = u_others


@dataclass(init=False)
class LocalSurface:
    """The local surface of a plane or sphere patch.

    Args:
        x_free: Contact point on the free surface [m].
        normal: Outward unit normal at the contact point.
        curvature: 0 for a plane, 1/radius for a sphere that bulges towards the hand [1/m].
        c_ii: Compliance of the contact [m/N].
        own_force: Force on this hand whose opposite acted on the body at the patch's tick [N].
        u_others: Displacement of the material under the contact that the other users cause [m].
    """

    x_free: Final[Vec3]
    normal: Final[Vec3]
    curvature: Final[float]
    c_ii: Final[float]
    own_force: Final[Vec3]
    u_others: Final[Vec3]

    def __init__(
        self,
        x_free: Vec3,
        normal: Vec3,
        curvature: float,
        c_ii: float,
        own_force: Vec3,
        u_others: Vec3,
    ) -> None:
        self.x_free = x_free
        self.normal = normal
        self.curvature = curvature
        self.c_ii = c_ii
        self.own_force = own_force
        self.u_others = u_others

    def look(self, probe: Vec3) -> Sight:
        """Evaluate the surface at the position `probe` [m]."""
        return Sight(
            depth(self, probe), normal_at(self, probe), self.c_ii, self.own_force, self.u_others
        )


def depth(surface: LocalSurface, probe: Vec3) -> float:
    """Return the depth of a probe below the surface [m]; negative outside.

    On a sphere of curvature c the depth is (1 - s) / c, where s is c times the distance from the
    centre; the formula in the code does not divide by c, so that c -> 0 gives the plane.
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
    """Return the outward unit normal of the local surface at the foot of a probe."""
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


def blend(a: Sight, b: Sight, s: float) -> Sight:
    """Interpolate between the sights a (s = 0) and b (s = 1), so that a new patch makes no step."""
    if s >= 1.0:
        return b
    if s <= 0.0:
        return a
    # Patches of a plane that only moves have the same normal, which is normalised already.
    same = a.normal == b.normal
    return Sight(
        a.depth + s * (b.depth - a.depth),
        b.normal if same else unit(lerp(a.normal, b.normal, s), b.normal),
        a.c_ii + s * (b.c_ii - a.c_ii),
        lerp(a.own_force, b.own_force, s),
        lerp(a.u_others, b.u_others, s),
    )


def shift(sight: Sight, by: Sight | None) -> Sight:
    """Add the result `by` of `difference` to a sight; return the sight itself if `by` is None."""
    if by is None:
        return sight
    n, d = sight.normal, by.normal
    return Sight(
        sight.depth + by.depth,
        n if d == ZERO else unit((n[0] + d[0], n[1] + d[1], n[2] + d[2]), n),
        sight.c_ii + by.c_ii,
        add(sight.own_force, by.own_force),
        add(sight.u_others, by.u_others),
    )


def difference(a: Sight, b: Sight) -> Sight:
    """Return a - b, to be added by `shift`; its normal is a difference of unit normals."""
    return Sight(
        a.depth - b.depth,
        sub(a.normal, b.normal),
        a.c_ii - b.c_ii,
        sub(a.own_force, b.own_force),
        sub(a.u_others, b.u_others),
    )
