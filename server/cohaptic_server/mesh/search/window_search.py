"""Finds vertices near the path on which a contact slides, for `world/patch_geometry.py`.

The module is compiled if a compiler is available; as plain Python it gives the same numbers.
"""

from __future__ import annotations

import math

import numpy as np

from cohaptic_server.mesh.search.point_tree import PointTree
from cohaptic_server.numeric import Floats, Ints


class WindowSearch:
    """Finds vertices of a touch mesh near the path on which a contact slides.

    Args:
        points: Resting positions, shape (t, 3) [m].
        normals: Outward unit normals at the points, shape (t, 3).
        beside: Vertices that share an edge with each vertex; short rows repeat the vertex itself,
            shape (t, valence).
        tree: Tree of the points.
        found: Array to which the search writes vertices, shape (t,).
        path: Array to which the search writes at most w points of a path, shape (w, 3) [m].

    Attributes:
        places: Number of points of the last path.
    """

    def __init__(
        self, points: Floats, normals: Floats, beside: Ints, tree: PointTree, found: Ints,
        path: Floats,
    ) -> None:  # fmt: skip
        self.points = points
        self.normals = normals
        self.beside = beside
        self.tree = tree
        self.found = found
        self.path = path
        self.tilt = np.zeros((len(path), 3))  # normal at each point of the path
        self.reached = np.zeros(len(points), dtype=np.int64)
        # Squared distance of a vertex from the path while the vertex can be taken; otherwise -1.
        self.least = np.full(len(points), -1.0)
        self.squares = np.zeros(len(points))
        self.sorted = np.zeros(len(points))
        self.places = 0

    def along(
        self,
        start: Floats,
        normal: Floats,
        direction: Floats,
        length: float,
        step: float,
        half_width: float,
        largest: int,
    ) -> int:
        """Write the vertices nearest to a contact's path to `found`; return their number.

        The vertices face the same way as the surface along the path, and are connected by edges.
        Vertices on the other side of a thin part and on other folds are left out, however near.

        Args:
            start: Contact point, shape (3,) [m].
            normal: Outward unit normal there, shape (3,).
            direction: Direction of the slide, of any length, shape (3,).
            length: Length of the path [m].
            step: Distance between two points of the path [m].
            half_width: Largest distance of a vertex from the path [m].
            largest: Largest number of vertices.
        """
        x, y, z = start[0], start[1], start[2]
        near = self.tree.within(x, y, z, length + half_width, self.found)
        if near == 0:
            return 0
        # Path points no further apart than vertices leave no gap between the discs round them.
        self.walk(near, start, normal, direction, length, step)
        first = self.mark(near, half_width * half_width)
        count = 0
        if first >= 0:
            count = self.spread(first)
        for k in range(near):
            self.least[self.found[k]] = -1.0
        for k in range(count):
            self.found[k] = self.reached[k]
        if count <= largest:
            return count
        limit = self.smallest(count, largest)
        kept = 0
        for k in range(count):
            if self.squares[k] <= limit and kept < largest:
                self.found[kept] = self.found[k]
                kept += 1
        return kept

    def mark(self, near: int, widest: float) -> int:
        """Write to `least` the squared distance from the path of each vertex that is near enough.

        Args:
            near: Number of vertices in `found`, which are examined.
            widest: Largest squared distance of a vertex from a point of the path at which the
                surface faces as the vertex does [m^2].

        Returns:
            The vertex nearest to the beginning of the path; -1 if there is none.
        """
        first, best = -1, 1e300
        for k in range(near):
            vertex = self.found[k]
            least = 1e300
            for w in range(self.places):
                if self.facing(vertex, self.tilt[w, 0], self.tilt[w, 1], self.tilt[w, 2]) <= 0.0:
                    continue
                dx = self.points[vertex, 0] - self.path[w, 0]
                dy = self.points[vertex, 1] - self.path[w, 1]
                dz = self.points[vertex, 2] - self.path[w, 2]
                square = dx * dx + dy * dy + dz * dz
                least = min(least, square)
                if w == 0 and square < best:
                    first, best = vertex, square
            if least <= widest:
                self.least[vertex] = least
        return first

    def spread(self, first: int) -> int:
        """Write to `reached` the vertices that edges connect to `first`; return their number.

        Only vertices that `mark` found near enough to the path are taken.
        """
        if self.least[first] < 0.0:
            return 0
        count = 1
        self.reached[0], self.squares[0], self.least[first] = first, self.least[first], -1.0
        done = 0
        while done < count:
            vertex = self.reached[done]
            done += 1
            for k in range(self.beside.shape[1]):
                other = self.beside[vertex, k]
                if self.least[other] >= 0.0:
                    self.reached[count] = other
                    self.squares[count] = self.least[other]
                    self.least[other] = -1.0
                    count += 1
        return count

    def facing(self, vertex: int | Ints, nx: float, ny: float, nz: float) -> float:
        """Return the cosine of the angle between a vertex's normal and another unit normal."""
        x, y, z = self.normals[vertex, 0], self.normals[vertex, 1], self.normals[vertex, 2]
        return float(x * nx + y * ny + z * nz)

    def walk(
        self,
        near: int,
        start: Floats,
        normal: Floats,
        direction: Floats,
        length: float,
        step: float,
    ) -> None:
        """Compute the path: points along the surface, from a contact in the direction of its slide.

        Args:
            near: Number of vertices in `found`, which lie round the path.
            start: Contact point, shape (3,) [m].
            normal: Outward unit normal there, shape (3,).
            direction: Direction of the slide, of any length, shape (3,).
            length: Length of the path [m].
            step: Distance between two points of the path [m].
        """
        x, y, z = start[0], start[1], start[2]
        nx, ny, nz = normal[0], normal[1], normal[2]
        hx, hy, hz = direction[0], direction[1], direction[2]
        self.path[0, 0], self.path[0, 1], self.path[0, 2] = x, y, z
        self.tilt[0, 0], self.tilt[0, 1], self.tilt[0, 2] = nx, ny, nz
        places = 1
        left = length
        while left > 1e-9 * step and places < self.path.shape[0]:
            stride = min(step, left)
            left -= stride
            fraction = stride / max(1e-12, math.sqrt(hx * hx + hy * hy + hz * hz))
            x, y, z = x + fraction * hx, y + fraction * hy, z + fraction * hz
            k = self.closest(near, x, y, z, nx, ny, nz)
            # Project point and heading onto the tangent plane of the nearest vertex.
            nx, ny, nz = self.normals[k, 0], self.normals[k, 1], self.normals[k, 2]
            off = (
                (self.points[k, 0] - x) * nx
                + (self.points[k, 1] - y) * ny
                + (self.points[k, 2] - z) * nz
            )
            x, y, z = x + off * nx, y + off * ny, z + off * nz
            off = hx * nx + hy * ny + hz * nz
            hx, hy, hz = hx - off * nx, hy - off * ny, hz - off * nz
            self.path[places, 0], self.path[places, 1], self.path[places, 2] = x, y, z
            self.tilt[places, 0], self.tilt[places, 1], self.tilt[places, 2] = nx, ny, nz
            places += 1
        self.places = places

    def closest(
        self, near: int, x: float, y: float, z: float, nx: float, ny: float, nz: float
    ) -> int:
        """Return the vertex nearest to (x, y, z) among vertices on one side of the body.

        Args:
            near: Number of vertices in `found`, which are examined.
            x, y, z: Position [m].
            nx, ny, nz: Unit normal; vertices that face the other way are left out.
        """
        best = 1e300
        closest = self.found[0]
        for k in range(near):
            vertex = self.found[k]
            dx = self.points[vertex, 0] - x
            dy = self.points[vertex, 1] - y
            dz = self.points[vertex, 2] - z
            square = dx * dx + dy * dy + dz * dz
            if square < best and self.facing(vertex, nx, ny, nz) > 0.0:
                best = square
                closest = vertex
        return int(closest)

    def smallest(self, count: int, rank: int) -> float:
        """Return the `rank`-th smallest of the first `count` entries of `squares` [m^2].

        The method is Hoare's selection; ranks begin at 1.
        """
        for k in range(count):
            self.sorted[k] = self.squares[k]
        low, high, wanted = 0, count - 1, rank - 1
        while low < high:
            pivot = self.sorted[wanted]
            i, j = low, high
            while i <= j:
                while self.sorted[i] < pivot:
                    i += 1
                while pivot < self.sorted[j]:
                    j -= 1
                if i <= j:
                    self.sorted[i], self.sorted[j] = self.sorted[j], self.sorted[i]
                    i += 1
                    j -= 1
            if j < wanted:
                low = i
            if wanted < i:
                high = j
        return float(self.sorted[wanted])
