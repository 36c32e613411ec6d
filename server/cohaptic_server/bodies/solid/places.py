"""The order of vertices in a column, by places: groups of 32 vertices close on the surface.

A contact reads the rows of the vertices round it from each column under it. In the order of a
mesh's file these rows may lie anywhere, and each costs a cache line and a half for its 36 bytes.
Recursive bisection, down to single vertices, therefore cuts the surface into places of 32 vertices:
vertices that are close on the surface are close in memory, and are read in runs of successive rows.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from cohaptic_server.numeric import Floats, Ints

# Positions of places in a column: 16 bits suffice for the 32,768 places of a million vertices.
Positions = npt.NDArray[np.int16]

# Vertices in a place. More vertices give longer runs; fewer waste less memory at the rim of a
# column, which keeps whole places.
PLACE = 32


class Places:
    """The vertices of a surface, grouped into places.

    Args:
        points: The vertices, shape (n, 3) [m].

    Attributes:
        count: Number of places, p; the last one may be filled up with copies of its last vertex.
        order: Vertices by rank, place after place, shape (p * PLACE,).
        rank: Position of each vertex in that order, shape (n,).
        centres: Mean position of the vertices of each place, shape (p, 3) [m].
    """

    def __init__(self, points: Floats) -> None:
        n = len(points)
        order = _bisected(points, np.arange(n))
        self.count = -(-n // PLACE)
        self.order: Ints = np.concatenate([order, np.repeat(order[-1:], self.count * PLACE - n)])
        self.rank: Ints = np.empty(n, dtype=np.int64)
        self.rank[order] = np.arange(n)
        self._points = points
        self.centres: Floats = points[self.order].reshape(-1, PLACE, 3).mean(axis=1)

    def vertices(self, places: Ints) -> Ints:
        """Return all vertices of some places (q,), place after place, shape (q * PLACE,)."""
        return self.order.reshape(-1, PLACE)[places].ravel()

    def within(self, reach: float) -> list[Ints]:
        """Return for each place the numbers of all places that are close to it, rising.

        A place is close if one of its vertices is within `reach` of a vertex of the other place, or
        if the centres are within `reach`. Centres that are too far apart exclude a place. Otherwise
        the vertices are compared, place by place: all pairs at once do not fit into memory.

        Args:
            reach: Largest distance of close places [m].
        """
        x = self._points[self.order].reshape(-1, PLACE, 3)
        extent = np.sqrt(((x - self.centres[:, None]) ** 2).sum(axis=2).max(axis=1))
        found: list[Ints] = []
        for k, centre in enumerate(self.centres):
            apart = np.sqrt(((self.centres - centre) ** 2).sum(axis=1))
            near = apart <= reach
            open_ = np.flatnonzero(~near & (apart <= reach + extent[k] + extent))
            own, off = x[k] - centre, x[open_] - centre
            squares = (off * off).sum(axis=2)[:, :, None] + (own * own).sum(axis=1)
            squares -= 2.0 * (off @ own.T)  # (q, PLACE, PLACE)
            near[open_] = squares.min(axis=(1, 2)) <= reach**2
            found.append(np.flatnonzero(near))
        return found


def _bisected(points: Floats, vertices: Ints) -> Ints:
    """Return `vertices` in the order of recursive bisection across their widest extent."""
    n = len(vertices)
    if n <= 2:
        return vertices
    x = points[vertices]
    axis = int(np.argmax(x.max(axis=0) - x.min(axis=0)))
    # The left part consists of whole places, so that no place straddles a cut.
    left = PLACE * (-(-n // PLACE) // 2) if n > PLACE else n // 2
    along = np.argpartition(x[:, axis], left)
    return np.concatenate(
        [_bisected(points, vertices[along[:left]]), _bisected(points, vertices[along[left:]])]
    )
