"""A displacement field that is known at some vertices, for loops that look up single vertices."""

from __future__ import annotations

import numpy as np

from cohaptic_server.numeric import Floats, Ints


class LoadedField:
    """Holds one displacement field at a time, the loaded field, on a surface of n vertices.

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
        """Replace the loaded field.

        Args:
            known: Vertices at which the new field is known, shape (k,).
            values: Displacement of these vertices, shape (k, 3), or of all vertices if `whole`,
                shape (n, 3) [m].
            whole: Whether `values` has a row for each vertex of the surface.
        """
        for k in range(self.known.shape[0]):
            self.row[self.known[k]] = -1
        for k in range(known.shape[0]):
            self.row[known[k]] = k
        self.known = known
        self.values = values
        self.whole = whole

    def follow(self, vertices: Ints, values: Floats, fraction: float, followed: Floats) -> None:
        """Interpolate linearly between the loaded field and another field.

        Args:
            vertices: Vertices at which the other field is known, shape (k,).
            values: Displacement of the other field at these vertices, shape (k, 3) [m].
            fraction: Weight of the other field, from 0 to 1.
            followed: Set to the interpolated field, or to the other field where the loaded one is
                not known, shape (k, 3) [m].
        """
        for k in range(vertices.shape[0]):
            row = self.row[vertices[k]]
            for axis in range(3):
                value = values[k, axis]
                if row >= 0:
                    before = self.values[row, axis]
                    value = before + fraction * (value - before)
                followed[k, axis] = value

    def moved(self, vertex: int, axis: int) -> float:
        """Return the displacement of a vertex along an axis [m].

        If the displacement is not known, set `lacking` and return 0.
        """
        if self.whole:
            return float(self.values[vertex, axis])
        row = self.row[vertex]
        if row < 0:
            self.lacking = True
            return 0.0
        return float(self.values[row, axis])
