"""Green's functions of a solid's surface, found when they are touched and kept while they are used.

A column is the displacement of every surface vertex for unit forces on one of them, in the three
directions. A contact is a weighted sum of the columns under it, so a finger that slides needs only
the few vertices that it newly covers. Columns are per vertex and not per contact: a contact changes
with every tick, its vertices do not. The cache is bounded in bytes; the least recently used go.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterable

import numpy as np

from cohaptic_server.bodies.mesh import Floats, Ints
from cohaptic_server.bodies.multifrontal import Factor

_BATCH = 16  # vertices in one solve: more of them cost less each, and hold more memory


class GreenColumns:
    """The columns of one held solid.

    Args:
        factor: Of the stiffness over the nodes that are free.
        nodes: Place of each surface vertex among the free nodes, -1 where it is held, shape (n,).
        budget: Memory for columns [bytes].

    Attributes:
        found: Columns solved for so far.
    """

    def __init__(self, factor: Factor, nodes: Ints, budget: int) -> None:
        self._factor = factor
        self._nodes = nodes
        self._free = np.flatnonzero(nodes >= 0)
        self._rows = (3 * nodes[self._free, None] + np.arange(3)).ravel()
        self.capacity = max(1, budget // self.column_bytes)
        self._kept: OrderedDict[int, Floats] = OrderedDict()
        self.found = 0

    @property
    def column_bytes(self) -> int:
        """Memory of one column."""
        return 9 * len(self._nodes) * 8

    @property
    def bytes(self) -> int:
        """Memory of all that are kept."""
        return len(self._kept) * self.column_bytes

    def __contains__(self, vertex: int) -> bool:
        return vertex in self._kept

    def ensure(self, vertices: Iterable[int]) -> None:
        """Solve for what is missing of `vertices`, and keep all of them over others."""
        wanted = list(dict.fromkeys(vertices))
        for vertex in wanted:
            if vertex in self._kept:
                self._kept.move_to_end(vertex)
        missing = [vertex for vertex in wanted if vertex not in self._kept]
        for start in range(0, len(missing), _BATCH):
            batch = missing[start : start + _BATCH]
            self._kept.update(zip(batch, self._solve(np.array(batch)), strict=True))
            self.found += len(batch)
        # What one tick needs stays, even beyond the budget.
        while len(self._kept) > max(self.capacity, len(wanted)):
            self._kept.popitem(last=False)

    def column(self, vertex: int) -> Floats:
        """Displacement per unit force on `vertex` along x, y, z, shape (3, 3 n) [m/N]."""
        if vertex not in self._kept:
            self.ensure([vertex])
        return self._kept[vertex]

    def respond(self, vertices: Ints, forces: Floats) -> Floats:
        """Displacement under whole cases of forces, solved directly and not kept.

        Args:
            vertices: With a force in some case, shape (k,).
            forces: Shape (k, 3, r) [N].

        Returns:
            Of every surface vertex, shape (r, 3 n) [m].
        """
        nodes = self._nodes[vertices]
        loose = nodes >= 0
        r = forces.shape[2]
        out = np.zeros((r, len(self._nodes), 3))
        if loose.any():
            x = self._factor.solve(nodes[loose], forces[loose].reshape(-1, r))
            out[:, self._free] = x[self._rows].T.reshape(r, -1, 3)
        return out.reshape(r, -1)

    def _solve(self, vertices: Ints) -> list[Floats]:
        k = len(vertices)
        unit = np.eye(3 * k).reshape(k, 3, 3 * k)
        columns = self.respond(vertices, unit).reshape(k, 3, -1)
        for column in columns:
            column.setflags(write=False)
        # Copies: a view would keep its whole batch in memory.
        return [column.copy() for column in columns]
