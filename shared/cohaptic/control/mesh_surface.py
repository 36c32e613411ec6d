"""The local surface of a mesh patch, made from vertices, smooth under a probe that slides.

Each vertex near the probe gives a depth of the probe by its position p_k and normal n_k. Moving
least squares with compact weights w_k combine the vertices to one surface, once continuously
differentiable, so that neither depth nor normal has a step where a probe slides over edges and
vertices:

    n = unit(sum_k w_k n_k),  depth = sum_k w_k (n_k + n) . (p_k - probe) / sum_k w_k (1 + n_k . n),
    w_k = (1 - (r_k^2 - d^2) / h_k^2)^2,

with the distance r_k from the probe to p_k, the probe's approximate depth d, and the radius h_k of
vertex k's weight. The mean of n_k and n makes the depth exact on spheres, and to second order
elsewhere. The normal n is that at the weighted mean of the vertices; the fit corrects it by the
vertices' bending to the normal at the probe's foot. The sums over vertices are in `mesh_fit.py`.

For a probe that is deep compared with the surface's radius of curvature the sum gives too small a
depth: on a torn ball it was 9 % too small at 14 mm. The server knows depth, normal and compliance
better on the contact's line, which goes through the contact along its normal: there the patch's own
plane is right, because the server put the contact where its normal meets the probe. On the line the
module uses the patch's own values, and the vertices only give the changes beside the line. The
error of the fitted surface on the line (`LineError`) is computed at points of the line when they
are needed, and interpolated between the points by cubics through four neighbours (Catmull and Rom
1974), so that its derivative by depth is continuous.

Beyond the patch's vertices, and near the line if the vertices' normal there differs from the
patch's, the module uses the plane or sphere of the same patch. Farther away plane and sphere no
longer describe the surface, and the vertices give the approximate depth: 0.1 m along a ring a
sphere is 39 mm off.
"""

from __future__ import annotations

import math
from array import array
from typing import Final

from cohaptic.control.geometry import LocalSurface, Sight
from cohaptic.control.mesh_fit import MeshFit, RestSurface
from cohaptic.vec import Vec3, dot, sub, unit

# The reach is the distance up to which a point counts as near. It is this fraction of the largest
# depth that a fit distinguishes (`mesh_fit.DEEPEST`): 6 mm on the balloon, a quarter of the radius
# of its vertices' weights. The least reach, for the smallest objects, is too small for a hand to
# feel [m]. Reasoned, not measured.
_REACH = 0.1
_LEAST_REACH = 0.0005
# Points on the line within one reach. On a balloon the error hardly changes within that distance.
# On an object of few elements the error does change: on rubber of 633 elements a finger 3 mm deep
# felt 1.2 % too little with one point, 0.1 % too much with four and 0.02 % with eight
# (`benchmarks/object_session.py`, pinched.stl).
_POINTS = 8
# Points up or down, 64 reaches; beyond them the last error is used, so that memory is bounded.
_FURTHEST = 512
# Cosines of the angle between the vertices' normal and the patch's on the line. Above `_ALIKE` the
# module uses the vertices near the line, too; below `_TURNED` it does not use them there: their
# normal then turns under a probe that moves sideways, while the server's does not, and the line's
# normal comes back late with each patch. On a rim 13 mm deep a hand of 400 N/m oscillated sideways
# at 250 ms; with a sphere the hand did not. Below `_STRANGE` the module uses the vertices nowhere:
# they belong to the far side of a thin part. They are the cosines of 3, 10 and 78 degrees; forces
# on six objects are in `benchmarks/many_objects.py`.
_ALIKE = 0.9986
_TURNED = 0.985
_STRANGE = 0.2
# Distance from the line, in reaches, at which the sphere or plane is no better than the vertices.
# Between this distance and 1.4 times as far the sphere or plane ceases to describe the surface: on
# a ring the sphere is 39 mm off 0.1 m away (`benchmarks/slide_solid.py`).
_NEAR = 2.5
# Distance from the line, in reaches, up to which the normal is corrected, and the depth with it, as
# if the vertices were turned. With a longer distance, or with only the normal turned, dragging with
# friction generated more energy, and the passivity layer observed 13 % less energy than there was.
_TURNING = 1.25
# On a limb a contact has a fifth of the compliance of the vertices beside it, whose normals lie
# nearer to the direction in which the limb bends. Below the contact the server's compliance is
# used, whatever that of the vertices is; the limit only keeps the factor from overflowing next to
# fixed vertices, whose compliance is nearly 0.
_MAX_FACTOR = 1e6

# Distance from the line within which the compliance fades to the contact's own: `_MOVED` times the
# distance by which other users have moved the surface here, at most `_APART` reaches. On a limb the
# compliance changes fivefold within the distance by which others move the contact sideways. The
# force changes with it, by the ratio of that distance to the depth: a loop through the other hands
# that no gain accounts for. Two hands that pinched a limb oscillated by half of their force, and at
# 250 ms also with 2.5 reaches (`benchmarks/object_session.py`). The hand's own motion over the
# surface causes no such loop.
_MOVED = 2.0
_APART = 4.0

# Cosine of the angle between the normals; error of the depth [m]; factor of the compliance;
# correction of the vertices' normal near the line (three numbers).
Error = tuple[float, float, float, float, float, float]
# Weights of the vertices' surface and of their compliance, 0 to 1; then the last five of `Error`.
Beside = tuple[float, float, float, float, float, float, float]
# Not `Final`: mypyc reports a final tuple that begins with a float as not set.
_NO_SURFACE: Error = (-1.0, 0.0, 1.0, 0.0, 0.0, 0.0)


def smooth(fraction: float) -> float:
    """Return the smooth step from 0 at 0 to 1 at 1, with zero slope at both ends."""
    s = min(1.0, max(0.0, fraction))
    return s * s * (3.0 - 2.0 * s)


class LineError:
    """The error of a fitted surface against the patch's plane or sphere, on the contact's line.

    The line goes through the contact point along the surface's normal.

    Args:
        fit: Surface fitted to the patch's vertices.
        base: Plane or sphere of the patch.
        moved: Distance by which other users have moved the surface under the finger [m].
    """

    def __init__(self, fit: MeshFit, base: LocalSurface, moved: float) -> None:
        self._fit: Final = fit
        self._base: Final = base
        self._reach: Final = max(_LEAST_REACH, _REACH * math.sqrt(fit.deepest))
        self._spacing: Final = self._reach / _POINTS
        self._apart: Final = min(_APART, _MOVED * moved / self._reach)
        self._points: Final[dict[int, Error]] = {}

    def lost(self, probe: Vec3) -> float:
        """Return the degree, 0 to 1, to which plane or sphere fails to describe the surface.

        The degree is 0 if `probe` is within `_NEAR` reaches of the contact's line, and 1 from 1.4
        times that distance on.
        """
        away = sub(probe, self._base.x_free)
        along = dot(away, self._base.normal)
        near = _NEAR * self._reach
        return smooth((dot(away, away) - along * along) / (near * near) - 1.0)

    def beside(self, probe: Vec3, depth: float) -> Beside:
        """Return the error at a probe, and the weight that the vertices should have there.

        Args:
            probe: Position of the probe [m].
            depth: Approximate depth of the probe [m].
        """
        place = min(max(depth / self._spacing, -float(_FURTHEST)), float(_FURTHEST))
        k = math.floor(place)
        t = place - k
        a, b, c, d = self._point(k - 1), self._point(k), self._point(k + 1), self._point(k + 2)
        # Weights of the four points; at t = 0 only the second counts, at t = 1 only the third.
        u = 1.0 - t
        wa, wd = -0.5 * t * u * u, -0.5 * u * t * t
        wb = 1.0 + t * t * (1.5 * t - 2.5)
        wc = 1.0 + u * u * (1.5 * u - 2.5)
        alike = wa * a[0] + wb * b[0] + wc * c[0] + wd * d[0]
        depth_error = wa * a[1] + wb * b[1] + wc * c[1] + wd * d[1]
        c_factor = wa * a[2] + wb * b[2] + wc * c[2] + wd * d[2]
        away, n = sub(probe, self._base.x_free), self._base.normal
        along = dot(away, n)
        beside = max(0.0, dot(away, away) - along * along) / (self._reach * self._reach)
        trust = smooth((alike - _TURNED) / (_ALIKE - _TURNED))
        if trust < 1.0:
            far = smooth((alike - _STRANGE) / (_TURNED - _STRANGE))
            trust += (far - trust) * smooth(beside / (_NEAR * _NEAR))
        apart = self._apart * self._apart
        soft = 1.0 if beside >= apart else smooth(beside / apart)
        near = 1.0 - beside / (_TURNING * _TURNING)
        if near <= 0.0:
            return (trust, soft, depth_error, c_factor, 0.0, 0.0, 0.0)
        near *= near
        turn = (
            near * (wa * a[3] + wb * b[3] + wc * c[3] + wd * d[3]),
            near * (wa * a[4] + wb * b[4] + wc * c[4] + wd * d[4]),
            near * (wa * a[5] + wb * b[5] + wc * c[5] + wd * d[5]),
        )
        depth_error += dot(turn, away) - along * dot(turn, n)
        return (trust, soft, depth_error, c_factor, turn[0], turn[1], turn[2])

    def _point(self, k: int) -> Error:
        found = self._points.get(k)
        if found is None:
            found = self._points[k] = self._measured(k * self._spacing)
        return found

    def _measured(self, depth: float) -> Error:
        x, n = self._base.x_free, self._base.normal
        fit = self._fit.evaluate(
            x[0] - depth * n[0], x[1] - depth * n[1], x[2] - depth * n[2], depth
        )
        if fit is None:
            return _NO_SURFACE
        found, nx, ny, nz, c_ii, _ = fit
        factor = 1.0
        if c_ii > 0.0:
            factor = min(_MAX_FACTOR, max(1.0 / _MAX_FACTOR, self._base.c_ii / c_ii))
        alike = nx * n[0] + ny * n[1] + nz * n[2]
        return (alike, found - depth, factor, n[0] - nx, n[1] - ny, n[2] - nz)


# Beside a contact the compliance is at most 4 times that of the contact, and at least a quarter of
# it unless the vertices themselves have less, as fixed vertices do: a larger difference would be
# valid for no longer than one tick. Reasoned, not measured.
_BESIDE = 4.0
# Weighted fractions of inner vertices (`MeshFit.at`): the module uses plane or sphere below
# `_OUTER`, the vertices above `_INNER`, and a mixture between them. Where plane or sphere no longer
# describes the surface (`LineError.lost`), `_INNER_LOST` replaces `_INNER`: plane or sphere is tens
# of mm off, and a twentieth of that is as much as a finger is deep. On a ring, where 97 vertices
# form two rows beside a path of 0.1 m, the force is 13 % off with 0.35 and 33 % with 0.5.
_OUTER = 0.05
_INNER = 0.5
_INNER_LOST = 0.2
# Fraction of inner vertices in the first of two fits, below which the second fit, which reaches
# farther vertices, fades out: without it the force stepped by all of itself where a finger slid off
# the edge of a block. The tenth is reasoned, not measured.
_SEEN = 0.1


class MeshSurface:
    """The local surface of a mesh patch: fitted to vertices, with plane or sphere beyond them.

    The caches only save time; no result depends on them.

    Args:
        rest: The resting mesh.
        base: Plane or sphere of the same patch.
        facts: Numbers of the patch's vertices, as `unpack` returns them.
        moved: Distance by which other users have moved the surface under the finger [m].
    """

    def __init__(
        self, rest: RestSurface, base: LocalSurface, facts: array[float], moved: float = 0.0
    ) -> None:
        self._base: Final = base
        self._fit: Final = MeshFit(rest, facts, base.normal)
        self._error: Final = LineError(self._fit, base, moved)
        # Normals of the nearest vertices are computed now, not in the period that first uses them.
        self._error.beside(base.x_free, 0.0)

    def look(self, probe: Vec3) -> Sight:
        """Evaluate the surface at the position `probe` [m]."""
        sight = self._base.look(probe)
        fit = self._fit.evaluate(probe[0], probe[1], probe[2], sight.depth)
        if fit is None:
            return sight
        estimate, shown, lost = sight.depth, 1.0, self._error.lost(probe)
        if lost > 0.0:
            # Far beside the contact the vertices give a better depth of the probe, unless their
            # normals point the other way, as on the far side of a thin part.
            depth, nx, ny, nz, _, inner = fit
            # The second fit must fade out before the first finds no vertices and ends it abruptly.
            shown -= lost * (1.0 - smooth(inner / _SEEN))
            theirs = lost * self._facing(nx, ny, nz)
            # Mix magnitudes: two signs could mix to a depth of 0, where the fit finds no vertices.
            near = abs(estimate) + theirs * (abs(depth) - abs(estimate))
            estimate += theirs * (depth - estimate)
            fit = self._fit.evaluate(probe[0], probe[1], probe[2], near)
            if fit is None:
                return sight
        depth, nx, ny, nz, c_ii, inner = fit
        enough = _INNER + lost * self._facing(nx, ny, nz) * (_INNER_LOST - _INNER)
        s = shown * smooth((inner - _OUTER) / (enough - _OUTER))
        if s <= 0.0:
            return sight
        trust, soft, depth_error, c_factor, tx, ty, tz = self._error.beside(probe, estimate)
        s *= trust
        least, limit = min(c_ii, sight.c_ii / _BESIDE), _BESIDE * sight.c_ii
        c_here = min(max(c_ii * c_factor, least), limit)
        n = sight.normal
        mixed = (
            n[0] + s * (nx + tx - n[0]),
            n[1] + s * (ny + ty - n[1]),
            n[2] + s * (nz + tz - n[2]),
        )
        return Sight(
            sight.depth + s * (depth - depth_error - sight.depth),
            unit(mixed, n),
            sight.c_ii + s * soft * (c_here - sight.c_ii),
            sight.own_force,
            sight.u_others,
        )

    def _facing(self, nx: float, ny: float, nz: float) -> float:
        """Return 1 for a normal within 90 degrees of the patch's, falling to 0 for its opposite."""
        n = self._base.normal
        return smooth(1.0 + nx * n[0] + ny * n[1] + nz * n[2])


Surface = LocalSurface | MeshSurface  # a local surface of any geometry
