"""Builds the tree of some points, and searches it for the points near one place."""

from __future__ import annotations

import numpy as np

from cohaptic_server.mesh.search.point_tree import PointTree
from cohaptic_server.numeric import Floats, Ints

LEAF = 8  # points in a leaf: with fewer, more boxes are compared; with more, more distances


class NearTree:
    """Search among points for all that lie within a radius of one place.

    Args:
        points: Positions of the points, shape (n, 3), n at least 1 [m].

    Attributes:
        tree: Tree of the points.
        found: Room for the indices of all points, shape (n,).
    """

    def __init__(self, points: Floats) -> None:
        self.tree = point_tree(points)
        self.found = np.zeros(len(points), dtype=np.int64)

    def near(self, point: Floats, radius: float) -> Ints:
        """Indices of the points within `radius` [m] of a place (3,) [m], in rising order, (k,)."""
        x, y, z = point.tolist()
        count = self.tree.within(x, y, z, radius, self.found)
        return np.sort(self.found[:count])


def point_tree(points: Floats) -> PointTree:
    """Build the tree of some points, shape (n, 3), n at least 1 [m]."""
    levels = 0
    while LEAF << levels < len(points):
        levels += 1
    order = _order(points, levels)
    placed = np.ascontiguousarray(points[order], dtype=np.float64)
    return PointTree(placed, order, _boxes(placed, levels), levels)


def _order(points: Floats, levels: int) -> Ints:
    """Order in which the points of each node lie together, split across their longest side."""
    n = len(points)
    order = np.arange(n, dtype=np.int64)
    for level in range(levels):
        for node in range(1 << level):
            start, stop = (node * n) >> level, ((node + 1) * n) >> level
            middle = ((2 * node + 1) * n) >> (level + 1)
            own = order[start:stop]
            places = points[own]
            axis = int(np.ptp(places, axis=0).argmax())
            own[:] = own[np.argpartition(places[:, axis], middle - start)]
    return order


def _boxes(points: Floats, levels: int) -> Floats:
    """Least and greatest coordinates of each node, the root at 1, shape (2^(levels + 1), 6) [m]."""
    leaves = 1 << levels
    boxes = np.zeros((2 * leaves, 6))
    starts = (np.arange(leaves) * len(points)) >> levels
    boxes[leaves:, :3] = np.minimum.reduceat(points, starts, axis=0)
    boxes[leaves:, 3:] = np.maximum.reduceat(points, starts, axis=0)
    for node in range(leaves - 1, 0, -1):
        boxes[node, :3] = np.minimum(boxes[2 * node, :3], boxes[2 * node + 1, :3])
        boxes[node, 3:] = np.maximum(boxes[2 * node, 3:], boxes[2 * node + 1, 3:])
    return boxes
