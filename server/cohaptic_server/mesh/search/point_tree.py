"""Finds the point nearest to a given position, and all points within a radius of the position.

The search uses a balanced tree of bounding boxes, which `mesh/surface.py` builds. Tests compare its
results with those of scipy's `cKDTree`. The search creates no Python object, since a tick searches
several times for each user.
"""

from __future__ import annotations

import numpy as np

from cohaptic_server.numeric import Floats, Ints

_DEPTH = 64  # length of the stack of a search; a tree of 2^60 points would fill it


class PointTree:
    """A tree of bounding boxes over points, which are sorted so that each box has a range of them.

    Args:
        points: Positions of the points in the order of the tree, shape (n, 3) [m].
        order: Index of each point in the order of the caller, shape (n,).
        boxes: Bounding box of each node: its least, then its greatest coordinates; the root has
            index 1; shape (2^(levels + 1), 6) [m].
        levels: Levels of the tree below its root.
    """

    def __init__(self, points: Floats, order: Ints, boxes: Floats, levels: int) -> None:
        self.levels = levels
        self.count = len(points)
        self.points = points
        self.order = order
        self.rank = np.zeros(len(points), dtype=np.int64)
        for k in range(self.count):
            self.rank[order[k]] = k
        self.boxes = boxes
        self.stack = np.zeros(_DEPTH, dtype=np.int64)

    def nearest(self, x: float, y: float, z: float) -> int:
        """Return the index, in the caller's order, of the point nearest to (x, y, z) [m]."""
        best, found = 1e300, 0
        self.stack[0] = 1
        size = 1
        while size > 0:
            size -= 1
            node = self.stack[size]
            if self.apart(node, x, y, z) >= best:
                continue
            if node >> self.levels == 1:  # a leaf
                for k in range(self.first(node), self.first(node + 1)):
                    square = self.square(k, x, y, z)
                    if square < best:
                        best, found = square, k
                continue
            node *= 2
            # The nearer child is put last, so that it is taken first.
            nearer = 0
            if self.apart(node + 1, x, y, z) < self.apart(node, x, y, z):
                nearer = 1
            self.stack[size] = node + 1 - nearer
            self.stack[size + 1] = node + nearer
            size += 2
        return int(self.order[found])

    def within(self, x: float, y: float, z: float, radius: float, found: Ints) -> int:
        """Write the points within a radius of a position to `found`; return their number.

        Args:
            x, y, z: Position [m].
            radius: Largest distance of a point from the position [m].
            found: Array as long as the number of all points; its first entries are set to the
                indices of the points, unsorted, in the order of the caller.
        """
        count = self.inside(x, y, z, radius, found)
        for k in range(count):
            found[k] = self.order[found[k]]
        return count

    def inside(self, x: float, y: float, z: float, radius: float, found: Ints) -> int:
        """Do the same as `within`, but write indices in the order of the tree."""
        limit = radius * radius
        count = 0
        self.stack[0] = 1
        size = 1
        while size > 0:
            size -= 1
            node = self.stack[size]
            if self.apart(node, x, y, z) > limit:
                continue
            if node >> self.levels == 1:
                for k in range(self.first(node), self.first(node + 1)):
                    if self.square(k, x, y, z) <= limit:
                        found[count] = k
                        count += 1
                continue
            self.stack[size] = 2 * node
            self.stack[size + 1] = 2 * node + 1
            size += 2
        return count

    def first(self, node: int) -> int:
        """Return the index of a leaf's first point, in the order of the tree.

        For the node after the last leaf this is the number of points.
        """
        leaf = node - (1 << self.levels)
        return (leaf * self.count) >> self.levels

    def square(self, k: int, x: float, y: float, z: float) -> float:
        """Return the squared distance of (x, y, z) from point `k` in the tree's order [m^2]."""
        dx = self.points[k, 0] - x
        dy = self.points[k, 1] - y
        dz = self.points[k, 2] - z
        return float(dx * dx + dy * dy + dz * dz)

    def apart(self, node: int, x: float, y: float, z: float) -> float:
        """Return the squared distance of (x, y, z) from the box of a node [m^2]."""
        dx = max(0.0, max(self.boxes[node, 0] - x, x - self.boxes[node, 3]))
        dy = max(0.0, max(self.boxes[node, 1] - y, y - self.boxes[node, 4]))
        dz = max(0.0, max(self.boxes[node, 2] - z, z - self.boxes[node, 5]))
        return float(dx * dx + dy * dy + dz * dz)

    def sort(self, numbers: Ints, count: int) -> None:
        """Sort the first `count` numbers, some tens, in place by Shell's method."""
        gap = 1
        while gap < count // 3:
            gap = 3 * gap + 1
        while gap > 0:
            for i in range(gap, count):
                number = numbers[i]
                j = i
                while j >= gap and numbers[j - gap] > number:
                    numbers[j] = numbers[j - gap]
                    j -= gap
                numbers[j] = number
            gap //= 3
