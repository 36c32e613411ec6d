"""Inner loops of a mesh surface: fit a surface to the displaced vertices near a probe.

`mesh_surface.py` has the formula. The module is compiled where a compiler is available; plain
Python gives the same numbers. It uses arrays of the standard library, since the haptic loop's
process has no numpy.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Iterable, Sequence
from itertools import accumulate

from cohaptic.vec import Vec3

# Radius h_k of a vertex's weight over the mean length of its edges: at one probe 10 to 12 vertices
# have a weight above 0. Reasoned; `cohaptic experiment slide` has the error of the force with it.
SUPPORT = 1.8
# m; distance that a probe may move before the near vertices are gathered again: 40 ms at 0.1 m/s. A
# larger margin makes every evaluation slower, a smaller one gathers more often. Reasoned, not
# measured.
MARGIN = 0.004
# Largest squared depth that is subtracted from a vertex's squared distance, as a multiple of the
# mean h_k^2: the square of 60 mm on the balloon, more than a press. Reasoned, not measured.
DEEPEST = 5.0
# Sum of weights below which no vertex counts as near: a twentieth of a vertex at the probe itself.
# Reasoned, not measured.
FEW = 0.05

FACT = 5  # numbers that a patch has for a vertex: index in the mesh, displacement, compliance
# Numbers that `MeshFit` stores for a vertex: position, h_k^2, compliance, 1 if the patch has all
# vertices around it and else 0, unit normal. Computing the normal takes long: until it is needed,
# INNER_AT has UNKNOWN.
VERTEX = 9
SUPPORT_AT, C_II_AT, INNER_AT, NORMAL_AT = 3, 4, 5, 6
UNKNOWN = -1.0


class RestSurface:
    """The resting mesh in the form that `MeshFit` needs; built once for all patches.

    Args:
        vertices: Positions of the vertices, shape (n, 3) [m].
        faces: Corners of the faces, counter-clockwise seen from outside, shape (m, 3).

    Attributes:
        points: Positions of the vertices, one behind the other, 3 n numbers [m].
        support: Squared radius h_k^2 of each vertex's weight, n numbers [m^2].
        starts: Index in `ring` at which the corners round each vertex start, n + 1 numbers.
        ring: The two other corners of each face round each vertex, in the order of the face.
        place: Index of each vertex in the patch of `owner`; arbitrary for vertices not in it.
        owner: Fit that filled `place` last; filling one table again is quicker than making a table
            for each fit.
    """

    def __init__(self, vertices: Sequence[Vec3], faces: Iterable[tuple[int, int, int]]) -> None:
        rings: list[list[int]] = [[] for _ in vertices]
        for a, b, c in faces:
            rings[a] += (b, c)
            rings[b] += (c, a)
            rings[c] += (a, b)
        self.points = array("d", [x for vertex in vertices for x in vertex])
        self.support = array("d", [_support(vertices, k, ring) for k, ring in enumerate(rings)])
        self.starts = array("q", accumulate(map(len, rings), initial=0))
        self.ring = array("q", [end for ring in rings for end in ring])
        self.place = array("q", bytes(8 * len(rings)))
        self.owner: MeshFit | None = None


def _support(vertices: Sequence[Vec3], k: int, ring: list[int]) -> float:
    """Return h_k^2, the squared radius of vertex k's weight: (`SUPPORT` mean edge)^2 [m^2]."""
    ends = set(ring)
    if not ends:
        return 1e-12  # a vertex without faces never gets a weight
    mean = sum(math.dist(vertices[end], vertices[k]) for end in ends) / len(ends)
    return max(1e-12, (SUPPORT * mean) ** 2)


def unpack(words: array[int], scale: float, c_scale: float, least: float) -> array[float]:
    """Convert the vertices of a mesh patch from the wire's numbers to SI units.

    Args:
        words: Numbers on the wire, `FACT` for each vertex, 16 bits (`protocol/neighbourhood.py`).
        scale: One unit of displacement [m].
        c_scale: One unit of compliance [m/N].
        least: Smallest compliance in the result; smaller values are raised to it [m/N].

    Returns:
        `FACT` numbers for each vertex: its index in the resting mesh, the three components of its
        displacement [m], and its compliance [m/N].
    """
    facts = array("d", bytes(8 * len(words)))
    _unpack(words, scale, c_scale, least, facts, len(words) // FACT)
    return facts


def _unpack(
    words: array[int], scale: float, c_scale: float, least: float, facts: array[float], count: int
) -> None:
    for k in range(count):
        at = FACT * k
        facts[at] = words[at] & 0xFFFF
        for i in range(1, 4):
            facts[at + i] = scale * words[at + i]
        c_ii = c_scale * (words[at + 4] & 0xFFFF)
        facts[at + 4] = c_ii if c_ii > least else least


class MeshFit:
    """A surface fitted to the vertices of a patch by moving least squares.

    The caches only save time; no result depends on them.

    Args:
        rest: The resting mesh.
        facts: Numbers of each vertex as `unpack` returns them; the displacement is that of the free
            surface, the compliance that of a contact centred at the vertex.
        out: Normal for a vertex whose faces have no normal.
    """

    def __init__(self, rest: RestSurface, facts: array[float], out: Vec3) -> None:
        self.rest = rest
        self.facts = facts
        self.out_x, self.out_y, self.out_z = out
        self.count = len(facts) // FACT
        self.vertices = array("d", bytes(8 * VERTEX * self.count))
        self.near = array("q", bytes(8 * self.count))
        self.gathered = 0
        self.reached = 0.0
        self.deepest = 1e-12
        self.center_x = self.center_y = self.center_z = math.inf
        self.begin()

    def begin(self) -> None:
        """Fill in each vertex's displaced position, squared weight radius and compliance."""
        total = 0.0
        for k in range(self.count):
            fact, at = FACT * k, VERTEX * k
            number = int(self.facts[fact])
            for i in range(3):
                self.vertices[at + i] = self.rest.points[3 * number + i] + self.facts[fact + 1 + i]
            self.vertices[at + SUPPORT_AT] = self.rest.support[number]
            self.vertices[at + C_II_AT] = self.facts[fact + 4]
            self.vertices[at + INNER_AT] = UNKNOWN
            total += self.rest.support[number]
        if self.count > 0 and DEEPEST * total / self.count > 1e-12:
            self.deepest = DEEPEST * total / self.count

    # Above 60 lines: a dozen sums over the vertices, and the surface computed from them.
    def evaluate(
        self, px: float, py: float, pz: float, depth: float
    ) -> tuple[float, float, float, float, float, float] | None:
        """Evaluate the fitted surface at a probe; return None if no vertex is near.

        Args:
            px: First coordinate of the probe [m].
            py: Second coordinate of the probe [m].
            pz: Third coordinate of the probe [m].
            depth: Approximate depth of the probe, from plane or sphere or from an earlier fit [m].

        Returns:
            Depth [m], the three components of the unit normal, the compliance c_ii [m/N], and the
            weighted fraction of inner vertices, 0 to 1. A vertex is inner if the patch has all
            corners of its faces.
        """
        dx, dy, dz = px - self.center_x, py - self.center_y, pz - self.center_z
        deep = depth if depth > 0.0 else -depth
        if deep > self.reached or not dx * dx + dy * dy + dz * dz < MARGIN * MARGIN:
            self.gather(px, py, pz, depth)
        below = self.below(depth)
        total = inner = c = along = spread = sx = sy = sz = nx = ny = nz = 0.0
        v = self.vertices
        for k in range(self.gathered):
            at = self.near[k]
            dx, dy, dz = v[at] - px, v[at + 1] - py, v[at + 2] - pz
            square = dx * dx + dy * dy + dz * dz
            w = 1.0 - (square - below) / v[at + SUPPORT_AT]
            if w > 0.0:
                if v[at + INNER_AT] == UNKNOWN:
                    self.find_normal(at)
                w *= w
                ax, ay, az = v[at + NORMAL_AT], v[at + NORMAL_AT + 1], v[at + NORMAL_AT + 2]
                total += w
                spread += w * square
                inner += w * v[at + INNER_AT]
                c += w * v[at + C_II_AT]
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
        # The mean normal is that at the weighted mean of the vertices; the bending term changes it
        # to the normal at the foot of the probe.
        spread -= (sx * sx + sy * sy + sz * sz) / total
        bending = along - (sx * nx + sy * ny + sz * nz) / total
        bending = bending / spread if spread > 1e-12 * total else 0.0
        foot = depth * total
        nx += bending * (foot * ux - sx)
        ny += bending * (foot * uy - sy)
        nz += bending * (foot * uz - sz)
        length = math.sqrt(nx * nx + ny * ny + nz * nz)
        if length > 1e-12:
            ux, uy, uz = nx * (1.0 / length), ny * (1.0 / length), nz * (1.0 / length)
        return depth, ux, uy, uz, c / total, inner / (total + FEW)

    def below(self, depth: float) -> float:
        """Return the squared depth to subtract from the squared distance of each vertex [m^2].

        The value saturates at `deepest`, since the depth from plane or sphere is poor far from the
        contact.
        """
        square = depth * depth
        fraction = square / self.deepest
        return square / math.sqrt(1.0 + fraction * fraction)

    def gather(self, px: float, py: float, pz: float, depth: float) -> None:
        """Fill `near` with the vertices that may get a weight while the probe stays near.

        `near` is valid until the probe has moved by `MARGIN` or is deeper than `reached`.
        """
        self.reached = (depth if depth > 0.0 else -depth) + MARGIN
        below = self.below(self.reached)
        v, found = self.vertices, 0
        for k in range(self.count):
            at = VERTEX * k
            dx, dy, dz = v[at] - px, v[at + 1] - py, v[at + 2] - pz
            r = math.sqrt(dx * dx + dy * dy + dz * dz) - MARGIN
            if r <= 0.0 or r * r < v[at + SUPPORT_AT] + below:
                self.near[found] = at
                found += 1
        self.gathered = found
        self.center_x, self.center_y, self.center_z = px, py, pz

    def find_normal(self, at: int) -> None:
        """Compute and store a displaced vertex's unit normal, exact on spheres (Max 1999).

        Args:
            at: Index in `vertices` at which the vertex's numbers begin.
        """
        if self.rest.owner is not self:
            self.rest.owner = self
            for k in range(self.count):
                self.rest.place[int(self.facts[FACT * k])] = k
        number = int(self.facts[FACT * (at // VERTEX)])
        known = 1.0
        nx = ny = nz = 0.0
        for i in range(self.rest.starts[number], self.rest.starts[number + 1], 2):
            first, second = self.rest.ring[i], self.rest.ring[i + 1]
            one, two = self.where(first), self.where(second)
            if one < 0 or two < 0:
                known = 0.0
            ax, bx = self.edge(at, one, first, 0), self.edge(at, two, second, 0)
            ay, by = self.edge(at, one, first, 1), self.edge(at, two, second, 1)
            az, bz = self.edge(at, one, first, 2), self.edge(at, two, second, 2)
            area = (ax * ax + ay * ay + az * az) * (bx * bx + by * by + bz * bz)
            if area > 0.0:
                nx += (ay * bz - az * by) / area
                ny += (az * bx - ax * bz) / area
                nz += (ax * by - ay * bx) / area
        length = math.sqrt(nx * nx + ny * ny + nz * nz)
        if length > 1e-12:
            nx, ny, nz = nx * (1.0 / length), ny * (1.0 / length), nz * (1.0 / length)
        else:
            nx, ny, nz = self.out_x, self.out_y, self.out_z
        v = self.vertices
        v[at + NORMAL_AT], v[at + NORMAL_AT + 1], v[at + NORMAL_AT + 2] = nx, ny, nz
        v[at + INNER_AT] = known

    def where(self, number: int) -> int:
        """Return the index of a vertex of the resting mesh in this patch; -1 if it is not in it."""
        k = self.rest.place[number]
        # Another patch may have left any number there, so compare it with this patch's facts.
        return k if k < self.count and int(self.facts[FACT * k]) == number else -1

    def edge(self, at: int, place: int, number: int, i: int) -> float:
        """Return one component of the edge from a vertex of this patch to another vertex [m].

        A vertex that is not in this patch is assumed to have the displacement of the first vertex.

        Args:
            at: Index in `vertices` at which the first vertex's numbers begin.
            place: Index of the other vertex in this patch, as `where` returns it.
            number: Index of the other vertex in the resting mesh.
            i: Component, 0 to 2.
        """
        if place >= 0:
            return self.vertices[VERTEX * place + i] - self.vertices[at + i]
        moved = self.facts[FACT * (at // VERTEX) + 1 + i]
        return self.rest.points[3 * number + i] + moved - self.vertices[at + i]
