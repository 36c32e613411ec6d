"""A displacement field at the vertices where it is known, for loops that look up each vertex."""

from __future__ import annotations

import numpy as np

from cohaptic_server.numeric import Floats, Ints


class LoadedField:
    """Holds one displacement field at a time, on a surface of n vertices.

    Args:
        count: Number of vertices, n.

    Attributes:
        lacking: Whether `moved` was called for a vertex whose displacement is not known; the caller
            resets it.
    """

    def __init__(self, count: int) -> None:
        self.row = np.full(count, -1, dtype=np.int64)
        self.known = np.zeros(0, dtype=np.int64)
        self.values = np.zeros((0, 3))
        self.whole = False
        self.lacking = False

    def load(self, known: Ints, values: Floats, whole: bool) -> None:
        """Hold a new displacement field: values at the vertices `known`, or at all if `whole`."""
        for k in range(self.known.shape[0]):
            self.row[self.known[k]] = -1
        for k in range(known.shape[0]):
            self.row[known[k]] = k
        self.known = known
        self.values = values
        self.whole = whole

    def follow(self, vertices: Ints, values: Floats, share: float, followed: Floats) -> None:
        """Compute the field that lies a share of the way from the loaded field to another one.

        Args:
            vertices: Vertices at which the other field is known, shape (k,).
            values: Displacement of the other field at these vertices, shape (k, 3) [m].
            share: Share of the way, 0 to 1.
            followed: Set to the field in between, or to the other field where the loaded one is not
                known, shape (k, 3) [m].
        """
        for k in range(vertices.shape[0]):
            row = self.row[vertices[k]]
            for axis in range(3):
                value = values[k, axis]
                if row >= 0:
                    before = self.values[row, axis]
                    value = before + share * (value - before)
                followed[k, axis] = value

    def moved(self, vertex: int, axis: int) -> float:
        """Displacement of a vertex along an axis [m]; 0, and `lacking` is set, if not known."""
        if self.whole:
            return float(self.values[vertex, axis])
        row = self.row[vertex]
        if row < 0:
            self.lacking = True
            return 0.0
        return float(self.values[row, axis])
