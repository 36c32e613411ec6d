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

The sums over vertices are in `mesh_fit.py`.
"""

from __future__ import annotations

from array import array
from typing import Final

from cohaptic.control.geometry import LocalSurface, Sight
from cohaptic.control.line_error import LineError
from cohaptic.control.mesh_fit import MeshFit, RestSurface
from cohaptic.vec import Vec3, unit

# Beside a contact the compliance is at most so many times that of the contact, and no smaller share
# of it unless vertices say so themselves, as held ones do: more is not known beyond one tick.
_BESIDE = 4.0


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
        depth, nx, ny, nz, c_ii, s = fit
        if s <= 0.0:
            return sight
        trust, soft, depth_error, c_factor, tx, ty, tz = self._error.at(probe, sight.depth)
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


Surface = LocalSurface | MeshSurface  # a local surface of any geometry
