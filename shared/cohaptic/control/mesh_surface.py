"""The third local surface: the neighbourhood of a contact on a mesh, smooth under a sliding probe.

Each vertex near the probe says by its position and normal how deep the probe is; moving least
squares with compact weights makes one surface of them, once continuously differentiable, so that
neither depth nor normal steps where a probe slides over edges and vertices:

    n = unit(sum_k w_k n_k),  depth = sum_k w_k (n_k + n) . (p_k - probe) / sum_k w_k (1 + n_k . n),
    w_k = (1 - (r_k^2 - d^2) / h_k^2)^2,  r_k from the probe to p_k,  d its depth, roughly.

The mean of n_k and n makes the depth exact on spheres, and to second order elsewhere; n itself is
then taken from the middle of the vertices to the foot of the probe by the bending between them.

A probe that is deep compared with how the surface bends sees too little of it: on a torn ball the
sum was 9 % short of the depth at 14 mm. The server knows better where the patch was made: below the
contact, along the normal, depth, normal and compliance are the patch's own, and the vertices say
only how they change beside that line (`line_error.py`). Where the neighbourhood ends, and near the
line where its normal is another than the patch's, plane or sphere of the same patch takes over.
Farther away both lose sight of the surface, and how deep the probe is, roughly, is the vertices' to
say: 0.1 m along a ring a sphere is 39 mm off.

The sums over vertices are in `mesh_fit.py`.
"""

from __future__ import annotations

from array import array
from typing import Final

from cohaptic.control.geometry import LocalSurface, Sight
from cohaptic.control.line_error import LineError, smooth
from cohaptic.control.mesh_fit import MeshFit, RestSurface
from cohaptic.vec import Vec3, unit

# Beside a contact the compliance is at most so many times that of the contact, and no smaller share
# of it unless vertices say so themselves, as held ones do: more is not known beyond one tick.
_BESIDE = 4.0
# Weighted share of inner vertices, whose faces are all known, between which plane or sphere (below
# the first) and the neighbourhood (above the second) are mixed. Where plane or sphere has lost
# sight of the surface (`LineError.lost`) the third counts instead of the second: plane or sphere is
# then tens of mm off, and a twentieth of that is as much as a finger is deep. On a ring, where 97
# vertices are two rows beside a way of 0.1 m, with 0.35 the force is 13 % off, with 0.5 33 %.
_OUTER = 0.05
_INNER = 0.5
_INNER_LOST = 0.2
# The same for the first of two looks, below which the second fades: it sees farther.
_SEEN = 0.1


class MeshSurface:
    """The surface of a mesh patch. Its caches only save time; results do not depend on them.

    Args:
        rest: The resting mesh.
        base: Plane or sphere of the same patch.
        facts: The neighbourhood, as `MeshFit` takes it.
        moved: Way that others have moved the surface under the finger [m].
    """

    def __init__(
        self, rest: RestSurface, base: LocalSurface, facts: array[float], moved: float = 0.0
    ) -> None:
        self._base: Final = base
        self._fit: Final = MeshFit(rest, facts, base.normal)
        self._error: Final = LineError(self._fit, base, moved)
        # Normals of the nearest vertices are found now, and not in the period that first looks.
        self._error.at(base.x_free, 0.0)

    def look(self, probe: Vec3) -> Sight:
        """The surface as evaluated at `probe` [m]."""
        sight = self._base.look(probe)
        fit = self._fit.at(probe[0], probe[1], probe[2], sight.depth)
        if fit is None:
            return sight
        rough, shown, lost = sight.depth, 1.0, self._error.lost(probe)
        if lost > 0.0:
            # Far beside the contact the vertices know better how deep the probe is, unless they
            # look the other way, as those of the far side of a thin part do.
            depth, nx, ny, nz, _, inner = fit
            # The second look must end no later than the first, which would end it at once.
            shown -= lost * (1.0 - smooth(inner / _SEEN))
            theirs = lost * self._facing(nx, ny, nz)
            # Of magnitudes, since the look is blind at a depth of 0, between two signs too.
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
        """1 for a normal within a right angle of the patch's, 0 for its opposite."""
        n = self._base.normal
        return smooth(1.0 + nx * n[0] + ny * n[1] + nz * n[2])


Surface = LocalSurface | MeshSurface  # a local surface of any geometry
