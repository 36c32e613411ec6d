"""The local surface of a mesh patch, made from vertices, smooth under a probe that slides.

Each vertex near the probe gives a depth of the probe by its position and normal. Moving least
squares with compact weights combine the vertices to one surface, once continuously differentiable,
so that neither depth nor normal has a step where a probe slides over edges and vertices:

    n = unit(sum_k w_k n_k),  depth = sum_k w_k (n_k + n) . (p_k - probe) / sum_k w_k (1 + n_k . n),
    w_k = (1 - (r_k^2 - d^2) / h_k^2)^2,  r_k from the probe to p_k,  d the probe's rough depth.

The mean of n_k and n makes the depth exact on spheres, and to second order elsewhere. The normal n
belongs to the middle of the vertices; their bending carries it from there to the probe's foot.

For a probe that is deep compared with the surface's radius of curvature the sum gives too small a
depth: on a torn ball it was 9 % too small at 14 mm. The server knows depth, normal and compliance
better on the line below the contact, along the normal. On that line the patch's own values are
used, and the vertices only give the changes beside that line (`line_error.py`). Plane or sphere of
the same patch takes over where the neighbourhood ends, and near the line if the vertices' normal
there differs from the patch's. Farther away plane and sphere no longer describe the surface, and
the vertices give the rough depth: 0.1 m along a ring a sphere is 39 mm off.

The sums over vertices are in `mesh_fit.py`.
"""

from __future__ import annotations

from array import array
from typing import Final

from cohaptic.control.geometry import LocalSurface, Sight
from cohaptic.control.line_error import LineError, smooth
from cohaptic.control.mesh_fit import MeshFit, RestSurface
from cohaptic.vec import Vec3, unit

# Beside a contact the compliance is at most 4 times that of the contact, and at least a quarter of
# it unless the vertices themselves have less, as held vertices do: a larger difference is not known
# for longer than one tick.
_BESIDE = 4.0
# Weighted shares of inner vertices, whose faces are all known: plane or sphere is used below
# `_OUTER`, the neighbourhood above `_INNER`, and a mixture between them. Where plane or sphere no
# longer describes the surface (`LineError.lost`), `_INNER_LOST` replaces `_INNER`: plane or sphere
# is tens of mm off, and a twentieth of that is as much as a finger is deep. On a ring, where 97
# vertices form two rows beside a path of 0.1 m, the force is 13 % off with 0.35 and 33 % with 0.5.
_OUTER = 0.05
_INNER = 0.5
_INNER_LOST = 0.2
# Share of inner vertices in the first of two fits, below which the second fit, which reaches
# farther vertices, fades out.
_SEEN = 0.1


class MeshSurface:
    """The surface of a mesh patch. Its caches only save time; results do not depend on them.

    Args:
        rest: The resting mesh.
        base: Plane or sphere of the same patch.
        facts: The neighbourhood, as `MeshFit` takes it.
        moved: Distance that others have moved the surface under the finger [m].
    """

    def __init__(
        self, rest: RestSurface, base: LocalSurface, facts: array[float], moved: float = 0.0
    ) -> None:
        self._base: Final = base
        self._fit: Final = MeshFit(rest, facts, base.normal)
        self._error: Final = LineError(self._fit, base, moved)
        # Normals of the nearest vertices are computed now, not in the period that first uses them.
        self._error.at(base.x_free, 0.0)

    def look(self, probe: Vec3) -> Sight:
        """The surface as evaluated at `probe` [m]."""
        sight = self._base.look(probe)
        fit = self._fit.at(probe[0], probe[1], probe[2], sight.depth)
        if fit is None:
            return sight
        rough, shown, lost = sight.depth, 1.0, self._error.lost(probe)
        if lost > 0.0:
            # Far beside the contact the vertices give a better depth of the probe, unless their
            # normals point the other way, as on the far side of a thin part.
            depth, nx, ny, nz, _, inner = fit
            # The second fit must fade out before the first finds no vertices and ends it abruptly.
            shown -= lost * (1.0 - smooth(inner / _SEEN))
            theirs = lost * self._facing(nx, ny, nz)
            # Mix magnitudes: two signs could mix to a depth of 0, where the fit finds no vertices.
            near = abs(rough) + theirs * (abs(depth) - abs(rough))
            rough += theirs * (depth - rough)
            fit = self._fit.at(probe[0], probe[1], probe[2], near)
            if fit is None:
                return sight
        depth, nx, ny, nz, c_ii, inner = fit
        enough = _INNER + lost * self._facing(nx, ny, nz) * (_INNER_LOST - _INNER)
        s = shown * smooth((inner - _OUTER) / (enough - _OUTER))
        if s <= 0.0:
            return sight
        trust, soft, depth_error, c_factor, tx, ty, tz = self._error.at(probe, rough)
        s *= trust
        least, most = min(c_ii, sight.c_ii / _BESIDE), _BESIDE * sight.c_ii
        c_here = min(max(c_ii * c_factor, least), most)
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
        """1 for a normal within a right angle of the patch's normal, down to 0 for its opposite."""
        n = self._base.normal
        return smooth(1.0 + nx * n[0] + ny * n[1] + nz * n[2])


Surface = LocalSurface | MeshSurface  # a local surface of any geometry
