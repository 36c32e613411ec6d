"""Green's functions of a solid's surface: solved for when contacts need them, stored while in use.

A column is the displacement of surface vertices for unit forces on one vertex, in three directions.
The response to a contact is a weighted sum of the columns under it, so that a sliding finger needs
new columns only for the few vertices that it newly covers. Columns belong to vertices and not to
contacts: a contact changes with every tick, its vertices do not. `column_store.py` stores columns.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from cohaptic_server.bodies.solid.column_store import Column, ColumnStore
from cohaptic_server.bodies.solid.places import Places
from cohaptic_server.cholesky.factor import Factor, FactorReader
from cohaptic_server.numeric import Floats, Ints, Narrow

_BATCH = 16  # vertices per solve; larger batches cost less per vertex, but take more memory


@dataclass(frozen=True, eq=False)
class ColumnRequest:
    """A request to solve for columns.

    Args:
        vertices: Vertices with the unit forces, shape (k,).
        places: Places (`places.py`) at whose vertices the columns are needed, rising, shape (q,).
    """

    vertices: Ints
    places: Ints


class GreenColumns:
    """The columns of one solid: the factor that gives them, and their store.

    Args:
        factor: Factor of the stiffness over the free nodes, or a reader that loads it when needed.
        nodes: Index of each surface vertex among the free nodes, -1 where it is fixed, shape (n,).
        points: The surface vertices, shape (n, 3) [m].
        budget: Memory for columns [bytes].

    Attributes:
        given: The factor or its reader; may be replaced while no thread solves.
        nodes: As given.
        places: Places of the surface vertices, the order of a column's rows.
        store: Store of the columns that have been solved for.
        solved: Number of columns solved for so far.
    """

    def __init__(
        self, factor: Factor | FactorReader, nodes: Ints, points: Floats, budget: int
    ) -> None:
        self.given = factor
        self.nodes = nodes
        self.places = Places(points)
        self._points, self._budget = points, budget
        self.store = ColumnStore(points, self.places, budget)
        self.solved = 0
        self._free = np.flatnonzero(nodes >= 0)
        self._rows = (3 * nodes[self._free, None] + np.arange(3)).ravel()

    @property
    def factor(self) -> Factor:
        """The factor; a stored factor is read at its first use.

        Raises:
            BodyError: The stored factor is damaged.
            OSError: The stored factor cannot be read.
        """
        if not isinstance(self.given, Factor):
            self.given = self.given.read()
        return self.given

    def keep(self, reach: float, *, fill: bool = True) -> None:
        """Replace the store by an empty one with columns of limited reach.

        Args:
            reach: Distance from its vertex up to which a column is stored [m].
            fill: As for `ColumnStore`.
        """
        self.store = ColumnStore(self._points, self.places, self._budget, reach, fill=fill)

    def ensure(self, vertices: Iterable[int]) -> None:
        """Solve for the missing columns of `vertices` in this call, and store them.

        The store holds all columns of `vertices`, even beyond the budget, since one tick needs them
        together.
        """
        needed = np.unique(np.fromiter(vertices, dtype=np.int64))
        self.store.grow(len(needed))
        self.store.tick(needed, 1.0)
        missing = needed[self.store.slot[needed] < 0]
        for start in range(0, len(missing), _BATCH):
            every = np.arange(self.places.count)
            request = ColumnRequest(missing[start : start + _BATCH], every)
            for column in self.solve(request):
                self.store.put(column, 1.0, 0)

    def solve(self, request: ColumnRequest) -> list[Column]:
        """Solve for the requested columns and return them, without storing them."""
        rows = self.places.vertices(request.places)
        values = solve_columns(self.factor, self.nodes, request.vertices, rows)
        self.solved += len(request.vertices)
        return columns_of(request, values)

    def respond(self, vertices: Ints, forces: Floats) -> Floats:
        """Solve for the displacement of the surface under several load cases, without columns.

        Args:
            vertices: Vertices with a force in any of the cases, shape (k,).
            forces: Forces on these vertices in the r cases, shape (k, 3, r) [N].

        Returns:
            Displacement of every surface vertex in each case, shape (r, 3 n) [m].
        """
        nodes = self.nodes[vertices]
        free = nodes >= 0
        r = forces.shape[2]
        out = np.zeros((r, len(self.nodes), 3))
        if free.any():
            x = self.factor.solve(nodes[free], forces[free].reshape(-1, r))
            out[:, self._free] = x[self._rows].T.reshape(r, -1, 3)
        return out.reshape(r, -1)


def columns_of(request: ColumnRequest, values: Narrow) -> list[Column]:
    """Return the columns of a request as views of `values`, the result of `solve_columns`."""
    blocks = values.reshape(len(request.vertices), len(request.places), -1)
    return [
        Column(vertex, request.places, block)
        for vertex, block in zip(request.vertices.tolist(), blocks, strict=True)
    ]


def solve_columns(factor: Factor, nodes: Ints, vertices: Ints, rows: Ints) -> Narrow:
    """Solve for the displacement of some vertices by unit forces on others.

    Args:
        factor: Factor of the stiffness over the free nodes.
        nodes: Index of each surface vertex among the free nodes, -1 where it is fixed, shape (n,).
        vertices: Vertices with the unit forces, shape (k,).
        rows: Vertices at which the displacement is needed, shape (r,).

    Returns:
        Displacement in x, y, z for a force in x, y, z, shape (k, r, 9) [m/N].
    """
    values = np.zeros((len(vertices), len(rows), 9), dtype=np.float32)
    loaded, observed = nodes[vertices], nodes[rows]
    free_columns, free_rows = np.flatnonzero(loaded >= 0), np.flatnonzero(observed >= 0)
    if len(free_columns) and len(free_rows):
        at = observed[free_rows] if len(rows) < len(nodes) else None
        x = factor.solve(loaded[free_columns], np.eye(3 * len(free_columns)), at)
        blocks = x[(3 * observed[free_rows, None] + np.arange(3)).ravel()]  # (3 rows, 3 columns)
        blocks = blocks.reshape(len(free_rows), 3, len(free_columns), 3).transpose(2, 0, 3, 1)
        values[free_columns[:, None], free_rows] = blocks.reshape(
            len(free_columns), len(free_rows), 9
        )
    return values
