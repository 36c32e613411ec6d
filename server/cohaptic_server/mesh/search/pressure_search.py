"""Finds the vertices under the pressure of a fingertip, and the share of the force on each.

The module is compiled if a compiler is available; as plain Python it gives the same numbers.
"""

from __future__ import annotations

import numpy as np

from cohaptic_server.mesh.search.point_tree import PointTree
from cohaptic_server.numeric import Floats, Ints

# Cosines of the angle between a finger's normal and the surface's: from `_BESIDE` on, the surface
# is pressed in full; below `_BEHIND`, not at all. A finger presses both faces of an edge, but not
# the other side of a thin part. In between the share falls gradually, so that the pressure has no
# step as a finger goes round a rim.
_BESIDE, _BEHIND = 0.0, -0.5


class PressureSearch:
    """Distributes the pressure of a fingertip over the vertices of one surface.

    Args:
        tree: Tree of the quadrature points; the next four arrays are in the order of the tree.
        areas: Areas of the quadrature points, shape (q,) [m^2].
        corners: Corners of the points' faces, shape (q, 3).
        fractions: Barycentric coordinates of the points, shape (q, 3).
        outward: Unit normals of the points' faces, shape (q, 3).
        under: Array for the vertices under a pressure, in rising order, shape (n,).
        weights: Array for the share of each of these vertices in the force, shape (n,).
    """

    def __init__(
        self, tree: PointTree, areas: Floats, corners: Ints, fractions: Floats, outward: Floats,
        under: Ints, weights: Floats,
    ) -> None:  # fmt: skip
        self.tree = tree
        self.areas = areas
        self.corners = corners
        self.fractions = fractions
        self.outward = outward
        self.under = under
        self.weights = weights
        self.found = np.zeros(len(areas), dtype=np.int64)
        self.table = np.zeros(len(under))
        self.count = 0
        self.total = 0.0

    def spread(
        self, x: float, y: float, z: float, nx: float, ny: float, nz: float, radius: float
    ) -> int:
        """Distribute a pressure over the vertices round its centre; return the number of vertices.

        At the distance r from the centre the pressure is proportional to 1 - (r / radius)^2, on the
        side of the surface that the finger presses. Each quadrature point distributes its part to
        the corners of its face. If the radius is below the mesh's resolution, the nearest
        quadrature point alone is loaded.

        Args:
            x, y, z: Centre of the pressure [m].
            nx, ny, nz: Outward unit normal of the finger; zeros to press all sides.
            radius: Radius of the pressure [m].
        """
        limit = radius * radius
        self.count = 0
        self.total = 0.0
        points = self.tree.inside(x, y, z, radius, self.found)
        for k in range(points):
            point = self.found[k]
            facing = (
                nx * self.outward[point, 0]
                + ny * self.outward[point, 1]
                + nz * self.outward[point, 2]
            )
            fraction = min(1.0, (facing - _BEHIND) / (_BESIDE - _BEHIND))
            if fraction > 0.0:
                profile = max(1e-12, 1.0 - self.tree.square(point, x, y, z) / limit)
                self.load(point, float(fraction * profile * self.areas[point]))
        if self.count == 0:
            point = self.tree.rank[self.tree.nearest(x, y, z)]
            self.load(point, 1.0)
        self.tree.sort(self.under, self.count)
        for k in range(self.count):
            vertex = self.under[k]
            self.weights[k] = self.table[vertex] / self.total
            self.table[vertex] = 0.0
        return self.count

    def load(self, point: int, force: float) -> None:
        """Distribute the force at one quadrature point to the corners of its face.

        Args:
            point: Index of the quadrature point in the order of the tree.
            force: Force in any unit; `spread` divides by the sum.
        """
        self.total += force
        for corner in range(3):
            part = force * self.fractions[point, corner]
            if part > 0.0:  # a face may have no area
                vertex = self.corners[point, corner]
                if self.table[vertex] == 0.0:
                    self.under[self.count] = vertex
                    self.count += 1
                self.table[vertex] += part
