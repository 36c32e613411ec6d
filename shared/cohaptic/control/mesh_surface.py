"""The third local surface: the neighbourhood of a contact on a mesh, smooth under a sliding probe.

Each vertex near the probe says by its position and normal how deep the probe is; moving least
squares with compact weights makes one surface of them, once continuously differentiable, so that
neither depth nor normal steps where a probe slides over edges and vertices:

    n = unit(sum_k w_k n_k),  depth = sum_k w_k (n_k + n) . (p_k - probe) / sum_k w_k (1 + n_k . n),
    w_k = (1 - (r_k^2 - d^2) / h_k^2)^2,  r_k from the probe to p_k,  d its depth, roughly.

The mean of n_k and n makes the depth exact on spheres, and to second order elsewhere; n itself is
then taken from the middle of the vertices to the foot of the probe by the bending between them. At
the point where the patch was made it is set right: the depth there is 0 and the compliance the
patch's own. Where the neighbourhood ends, plane or sphere of the same patch takes over.

Plain tuples and loops: this runs in the haptic loop's process, without numpy.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Final

from cohaptic.control.geometry import LocalSurface, Sight
from cohaptic.vec import Vec3, dot, norm, sub, unit

SUPPORT: Final = 1.8  # h_k in mean edges at the vertex: 10 to 12 vertices count at a time
# m that a probe may move before its near vertices are gathered again: 40 ms at 0.1 m/s. A larger
# one makes every evaluation slower, a smaller one gathers more often.
_MARGIN: Final = 0.004
# Weighted share of inner vertices, whose faces are all known, between which plane or sphere (below
# the first) and the neighbourhood (above the second) are mixed.
_OUTER: Final = 0.05
_INNER: Final = 0.5
# Largest squared depth that is subtracted from r^2, in h^2: 60 mm on the balloon.
_DEEPEST: Final = 5.0
_FEW: Final = 0.05  # sum of weights below which no vertex counts as near


class RestSurface:
    """The resting mesh as `MeshSurface` needs it; built once.

    Args:
        vertices: Shape (n, 3) [m].
        faces: Counter-clockwise seen from outside, shape (m, 3).

    Attributes:
        vertices: As given.
        rings: The two other corners of each face round each vertex, in the order of the face.
        support: h_k^2 of each vertex [m^2].
    """

    def __init__(self, vertices: Sequence[Vec3], faces: Iterable[tuple[int, int, int]]) -> None:
        self.vertices = tuple(vertices)
        self.rings: tuple[list[tuple[int, int]], ...] = tuple([] for _ in self.vertices)
        for a, b, c in faces:
            self.rings[a].append((b, c))
            self.rings[b].append((c, a))
            self.rings[c].append((a, b))
        self.support = tuple(self._support(k) for k in range(len(self.vertices)))

    def _support(self, k: int) -> float:
        ends = {end for pair in self.rings[k] for end in pair}
        if not ends:
            return 1e-12  # a vertex of no face: it never counts
        edges = [norm(sub(self.vertices[end], self.vertices[k])) for end in ends]
        return max(1e-12, (SUPPORT * sum(edges) / len(edges)) ** 2)


class MeshVertex:
    """A vertex of a neighbourhood: what a patch says of it, and what its surface makes of that.

    Args:
        number: In the resting mesh.
        displacement: Without this client's own force [m].
        c_ii: Compliance of a contact centred there [m/N].
    """

    __slots__ = (
        "c_ii", "displacement", "has_normal", "inner", "number", "nx", "ny", "nz", "support",
        "x", "y", "z",
    )  # fmt: skip

    def __init__(self, number: int, displacement: Vec3, c_ii: float) -> None:
        self.number = number
        self.displacement = displacement
        self.c_ii = c_ii
        self.x = self.y = self.z = 0.0  # [m]
        self.support = 1.0  # h^2 [m^2]
        # The unit normal takes long, and is computed when it is needed for the first time.
        self.has_normal = False
        self.nx = self.ny = self.nz = 0.0
        self.inner = 0.0  # 1 where all the vertices around it are known


class _Fit:
    """The fit of the vertices at a probe: depth, normal, c_ii, and its weight against the base."""

    __slots__ = ("c_ii", "depth", "normal", "trust")

    def __init__(self, depth: float, normal: Vec3, c_ii: float, trust: float) -> None:
        self.depth = depth
        self.normal = normal
        self.c_ii = c_ii
        self.trust = trust


class MeshSurface:
    """The surface of a mesh patch. Its caches only save time; results do not depend on them.

    Args:
        rest: The resting mesh.
        base: Plane or sphere of the same patch.
        vertices: The neighbourhood; from now on this surface's own.
    """

    def __init__(
        self, rest: RestSurface, base: LocalSurface, vertices: Iterable[MeshVertex]
    ) -> None:
        self._rest = rest
        self._base = base
        self._vertices: dict[int, MeshVertex] = {}
        total = 0.0
        for vertex in vertices:
            p, u = rest.vertices[vertex.number], vertex.displacement
            vertex.x, vertex.y, vertex.z = p[0] + u[0], p[1] + u[1], p[2] + u[2]
            vertex.support = rest.support[vertex.number]
            self._vertices[vertex.number] = vertex
            total += vertex.support
        self._deepest = max(1e-12, _DEEPEST * total / max(1, len(self._vertices)))
        self._near: list[MeshVertex] = []
        self._center: Vec3 = (math.inf, math.inf, math.inf)
        self._offset = 0.0
        self._factor = 1.0
        centre = self._fit(base.x_free, 0.0)
        if centre is not None:
            self._offset = -centre.depth
            if centre.c_ii > 0.0:
                # Far from 1 only next to fixed vertices, where the compliance falls to zero.
                self._factor = min(4.0, max(0.25, base.c_ii / centre.c_ii))

    def look(self, probe: Vec3) -> Sight:
        """The surface as evaluated at `probe` [m]."""
        sight = self._base.look(probe)
        fit = self._fit(probe, sight.depth)
        if fit is None or fit.trust <= 0.0:
            return sight
        s, n, m = fit.trust, sight.normal, fit.normal
        mixed = (n[0] + s * (m[0] - n[0]), n[1] + s * (m[1] - n[1]), n[2] + s * (m[2] - n[2]))
        return Sight(
            sight.depth + s * (fit.depth + self._offset - sight.depth),
            unit(mixed, n),
            sight.c_ii + s * (fit.c_ii * self._factor - sight.c_ii),
            sight.own_force,
            sight.u_others,
        )

    def _fit(self, probe: Vec3, depth: float) -> _Fit | None:
        """Moving least squares at a probe; None where no vertex is near.

        Args:
            probe: [m].
            depth: Of the probe below plane or sphere, roughly its depth [m].
        """
        px, py, pz = probe
        way = sub(probe, self._center)
        if not dot(way, way) < _MARGIN * _MARGIN:
            self._gather(probe, depth)
        below = self._below(depth)
        total = inner = c = along = spread = sx = sy = sz = nx = ny = nz = 0.0
        for vertex in self._near:
            dx, dy, dz = vertex.x - px, vertex.y - py, vertex.z - pz
            square = dx * dx + dy * dy + dz * dz
            w = 1.0 - (square - below) / vertex.support
            if w > 0.0:
                if not vertex.has_normal:
                    self._find_normal(vertex)
                w *= w
                ax, ay, az = vertex.nx, vertex.ny, vertex.nz
                total += w
                spread += w * square
                inner += w * vertex.inner
                c += w * vertex.c_ii
                sx += w * dx
                sy += w * dy
                sz += w * dz
                nx += w * ax
                ny += w * ay
                nz += w * az
                along += w * (dx * ax + dy * ay + dz * az)
        length = math.sqrt(nx * nx + ny * ny + nz * nz)
        if total <= 0.0 or length <= 1e-9 * total:
            return None
        ux, uy, uz = nx / length, ny / length, nz / length
        depth = (along + sx * ux + sy * uy + sz * uz) / (total + length)
        # The mean normal belongs to the middle of the vertices; by the bending it is taken from
        # there to the foot of the probe.
        spread -= (sx * sx + sy * sy + sz * sz) / total
        bending = along - (sx * nx + sy * ny + sz * nz) / total
        bending = bending / spread if spread > 1e-12 * total else 0.0
        foot = depth * total
        normal = unit(
            (
                nx + bending * (foot * ux - sx),
                ny + bending * (foot * uy - sy),
                nz + bending * (foot * uz - sz),
            ),
            (ux, uy, uz),
        )
        s = min(1.0, max(0.0, (inner / (total + _FEW) - _OUTER) / (_INNER - _OUTER)))
        return _Fit(depth, normal, c / total, s * s * (3.0 - 2.0 * s))

    def _below(self, depth: float) -> float:
        """The squared depth that is subtracted from r^2 [m^2].

        It saturates at `_DEEPEST`, since far from the contact plane and sphere give a poor depth.
        """
        square = depth * depth
        share = square / self._deepest
        return square / math.sqrt(1.0 + share * share)

    def _gather(self, probe: Vec3, depth: float) -> None:
        """Collect each vertex whose weight can be positive before the probe moves by the margin."""
        # A probe that moves by the margin is deeper by no more than that.
        below = self._below(abs(depth) + _MARGIN)
        self._near = []
        for vertex in self._vertices.values():
            dx, dy, dz = vertex.x - probe[0], vertex.y - probe[1], vertex.z - probe[2]
            r = math.sqrt(dx * dx + dy * dy + dz * dz) - _MARGIN
            if r <= 0.0 or r * r < vertex.support + below:
                self._near.append(vertex)
        self._center = probe

    def _find_normal(self, vertex: MeshVertex) -> None:
        """Compute the unit normal of a displaced vertex, exact on spheres (Max 1999)."""
        known = 1.0
        nx = ny = nz = 0.0
        for i, j in self._rest.rings[vertex.number]:
            u, v = self._vertices.get(i), self._vertices.get(j)
            if u is None or v is None:
                known = 0.0
            ax, ay, az = self._edge(vertex, i, u)
            bx, by, bz = self._edge(vertex, j, v)
            area = (ax * ax + ay * ay + az * az) * (bx * bx + by * by + bz * bz)
            if area > 0.0:
                nx += (ay * bz - az * by) / area
                ny += (az * bx - ax * bz) / area
                nz += (ax * by - ay * bx) / area
        vertex.nx, vertex.ny, vertex.nz = unit((nx, ny, nz), self._base.normal)
        vertex.inner = known
        vertex.has_normal = True

    def _edge(self, vertex: MeshVertex, number: int, end: MeshVertex | None) -> Vec3:
        """From a vertex to another; one of unknown displacement is taken to move with it [m]."""
        if end is not None:
            return (end.x - vertex.x, end.y - vertex.y, end.z - vertex.z)
        p, u = self._rest.vertices[number], vertex.displacement
        return (p[0] + u[0] - vertex.x, p[1] + u[1] - vertex.y, p[2] + u[2] - vertex.z)


Surface = LocalSurface | MeshSurface  # a local surface of any geometry
