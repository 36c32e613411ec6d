"""Green's functions of a solid's surface: found when they are touched, kept while they are used.

A column is the displacement of surface vertices for unit forces on one of them, in the three
directions. A contact is a weighted sum of the columns under it, so a finger that slides needs only
the few vertices that it newly covers. Columns are per vertex and not per contact: a contact changes
with every tick, its vertices do not. They lie in one slab of single precision, bounded in bytes, so
that a tick gathers from all of them at once; the least recently used go.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cohaptic_server.cholesky.factor import Factor
from cohaptic_server.numeric import Floats, Ints

_BATCH = 16  # vertices in one solve: more of them cost less each, and hold more memory
LEAST = 256  # columns that fit whatever the budget: more than one tick of a full room touches
_IN_USE = 4  # ticks for which a column that was used stays: what is known of a tick may be asked

Narrow = npt.NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Column:
    """One that was found.

    Args:
        vertex: With the unit force.
        rows: Vertices whose displacement is known, shape (k,).
        values: For a force in x, y, z: displacement in x, y, z; shape (k, 9) [m/N].
    """

    vertex: int
    rows: Ints
    values: Narrow


@dataclass(frozen=True, eq=False)
class Order:
    """Columns to be found.

    Args:
        vertices: With the unit forces, shape (k,).
        rows: Vertices whose displacement counts, rising, shape (r,).
    """

    vertices: Ints
    rows: Ints


class GreenColumns:
    """The columns of one held solid.

    Args:
        factor: Of the stiffness over the nodes that are free.
        nodes: Place of each surface vertex among the free nodes, -1 where it is held, shape (n,).
        budget: Memory for columns [bytes].
        length: Rows that a column has at most; all if not given.

    Attributes:
        factor: As given.
        nodes: As given.
        found: Columns solved for so far.
        slot: Place of each vertex's column in the slab, -1 for none, shape (n,).
        share: How far each slot counts, from 0 when it is new to 1, shape (slots,).
    """

    def __init__(self, factor: Factor, nodes: Ints, budget: int, length: int | None = None) -> None:
        self.factor = factor
        self.nodes = nodes
        self._free = np.flatnonzero(nodes >= 0)
        self._rows = (3 * nodes[self._free, None] + np.arange(3)).ravel()
        self.length = len(nodes) if length is None else min(length, len(nodes))
        short = self.length < len(nodes)
        self.column_bytes = 36 * self.length + (4 * len(nodes) if short else 0)
        self.capacity = max(min(LEAST, len(nodes)), min(budget // self.column_bytes, len(nodes)))
        self.found = 0
        self._allocate()

    def _allocate(self) -> None:
        self.slot: Ints = np.full(len(self.nodes), -1, dtype=np.int64)
        # Whole columns are not filled: memory is taken as they come.
        self._slab = np.empty((self.capacity, self.length, 9), dtype=np.float32)
        # Place of a vertex among the rows of a column; of no use where columns have all of them.
        # Columns of one order share a table: what a tick reads of them stays near at hand.
        short = self.length < len(self.nodes)
        if short:
            self._slab.fill(0.0)  # a tick has no time for the system to find memory
        kind = np.uint16 if self.length <= np.iinfo(np.uint16).max else np.int32
        self._row = np.zeros((self.capacity if short else 0, len(self.nodes)), kind)
        self._table = np.full(self.capacity, -1, dtype=np.int64)  # of each slot
        self._rows_of: dict[int, Ints] = {}  # by table, while a column has it
        self.share = np.zeros(self.capacity)
        self._holds = np.full(self.capacity, -1, dtype=np.int64)
        self._used = np.full(self.capacity, -_IN_USE - 1, dtype=np.int64)
        self._now = 0
        self._since = np.zeros(len(self.nodes), dtype=np.int64)
        self._touched = np.full(len(self.nodes), -1, dtype=np.int64)

    @property
    def kept(self) -> int:
        """How many there are."""
        return int((self._holds >= 0).sum())

    def tick(self, touched: Ints, step: float) -> None:
        """Note what this tick touches.

        Args:
            touched: Vertices.
            step: By how much the share of every column grows.
        """
        self._now += 1
        # A vertex that was not touched in the tick before is touched anew.
        anew = touched[self._touched[touched] < self._now - 1]
        self._since[anew] = self._now
        self._touched[touched] = self._now
        slots = self.slot[touched]
        self._used[slots[slots >= 0]] = self._now
        np.minimum(1.0, self.share + step, out=self.share)

    def lacking(self, vertices: Ints, ticks: int) -> Ints:
        """Those of the touched `vertices` that have no column, and have been touched that long."""
        stayed = self._now - self._since[vertices] >= ticks
        return vertices[stayed & (self.slot[vertices] < 0)]

    def put(self, column: Column, share: float, keep: int = _IN_USE) -> bool:
        """Keep a column, in the place of the least recently used.

        Args:
            column: It, with no more rows than a column may have.
            share: How far it counts at first.
            keep: Ticks for which a column that was used must stay.

        Returns:
            Whether there was a place: none is, if all are in use.
        """
        if self.slot[column.vertex] >= 0:
            return True
        place = int(self._used.argmin())
        if self._used[place] >= self._now - keep and self._holds[place] >= 0:
            return False
        if self._holds[place] >= 0:
            self.slot[self._holds[place]] = -1
        if len(self._row):
            self._set_table(place, column.rows)
            self._slab[place, : len(column.rows)] = column.values
        else:
            if len(column.rows) < len(self.nodes):
                self._slab[place] = 0.0  # what an order left out lies too far away to count
            self._slab[place, column.rows] = column.values
        self._holds[place], self.slot[column.vertex] = column.vertex, place
        self.share[place], self._used[place] = share, self._now
        return True

    def _set_table(self, place: int, rows: Ints) -> None:
        """Give a slot the table of its rows: that of the column before, if of the same order."""
        left = int(self._table[place])
        self._table[place] = -1
        if left >= 0 and not (self._table == left).any():
            del self._rows_of[left]
        table = next((k for k, known in reversed(self._rows_of.items()) if known is rows), None)
        if table is None:
            table = next(k for k in range(self.capacity) if k not in self._rows_of)
            self._row[table, rows] = np.arange(len(rows))
            self._rows_of[table] = rows
        self._table[place] = table

    def ensure(self, vertices: Iterable[int]) -> None:
        """Solve for what is missing of `vertices`, at once, and keep all of them over others."""
        wanted = np.unique(np.fromiter(vertices, dtype=np.int64))
        if len(wanted) > self.capacity:
            self.capacity = len(wanted)  # what one tick needs stays, even beyond the budget
            self._allocate()
        self.tick(wanted, 1.0)
        missing = wanted[self.slot[wanted] < 0]
        for start in range(0, len(missing), _BATCH):
            order = Order(missing[start : start + _BATCH], np.arange(len(self.nodes)))
            for column in self.solve(order):
                self.put(column, 1.0, 0)

    def block(self, vertices: Ints, weights: Floats) -> Floats | None:
        """Compliance of a contact at itself in all directions, if all of it is there.

        Args:
            vertices: Under the contact, shape (k,).
            weights: Share of each, shape (k,).

        Returns:
            Shape (3, 3) [m/N]; None where a column is missing or still new.
        """
        slots = self.slot[vertices]
        if (slots < 0).any() or (self.share[slots] < 1.0).any():
            return None
        return np.asarray(np.tensordot(weights, self.sums(slots, weights, vertices), axes=(0, 0)))

    def pull(self, slots: Ints, weights: Floats, direction: Floats, rows: Ints) -> Floats:
        """Displacement of some vertices under a weighted sum of columns, shape (k, 3) [m/N].

        Args:
            slots: Of the columns, shape (s,).
            weights: Share of a unit force on each, shape (s,).
            direction: Of the force, shape (3,).
            rows: Vertices, shape (k,).
        """
        return np.asarray(direction @ self.sums(slots, weights, rows))

    def sums(self, slots: Ints, weights: Floats, rows: Ints) -> Floats:
        """As `pull` for a force in x, y, z: shape (k, 3, 3) [m/N]."""
        narrow = weights.astype(np.float32)
        if not len(self._row) and len(rows) * 2 > len(self.nodes):
            whole = np.zeros((len(self.nodes), 9), dtype=np.float32)
            for slot, weight in zip(slots.tolist(), narrow.tolist(), strict=True):
                whole += np.float32(weight) * self._slab[slot]
            sums = whole[rows]
        else:
            # One index into one long table: half of the time of two.
            across, places = slots[:, None], rows
            if len(self._row):
                table = self._row.ravel()
                tables = self._table[slots, None]
                found = table.take(tables * len(self.nodes) + rows, mode="clip")
                places = found.astype(np.int64)
            flat = self._slab.reshape(-1, 9)
            values = flat.take((across * self.length + places).ravel(), 0, mode="clip")
            sums = narrow @ values.reshape(len(slots), -1)
        return sums.reshape(-1, 3, 3).astype(np.float64)

    def solve(self, order: Order) -> list[Column]:
        """Columns of some vertices; they are not kept."""
        values = solve_columns(self.factor, self.nodes, order)
        self.found += len(order.vertices)
        return [
            Column(vertex, order.rows, values[i])
            for i, vertex in enumerate(order.vertices.tolist())
        ]

    def respond(self, vertices: Ints, forces: Floats) -> Floats:
        """Displacement under whole cases of forces, solved directly and not kept.

        Args:
            vertices: With a force in some case, shape (k,).
            forces: Shape (k, 3, r) [N].

        Returns:
            Of every surface vertex, shape (r, 3 n) [m].
        """
        nodes = self.nodes[vertices]
        loose = nodes >= 0
        r = forces.shape[2]
        out = np.zeros((r, len(self.nodes), 3))
        if loose.any():
            x = self.factor.solve(nodes[loose], forces[loose].reshape(-1, r))
            out[:, self._free] = x[self._rows].T.reshape(r, -1, 3)
        return out.reshape(r, -1)


def solve_columns(factor: Factor, nodes: Ints, order: Order) -> Narrow:
    """The columns of an order.

    Args:
        factor: Of the stiffness over the nodes that are free.
        nodes: Place of each surface vertex among the free nodes, -1 where it is held, shape (n,).
        order: Which.

    Returns:
        As `Column.values`, shape (k, r, 9) [m/N].
    """
    values = np.zeros((len(order.vertices), len(order.rows), 9), dtype=np.float32)
    pushed, seen = nodes[order.vertices], nodes[order.rows]
    loose, free = np.flatnonzero(pushed >= 0), np.flatnonzero(seen >= 0)
    if len(loose) and len(free):
        at = seen[free] if len(order.rows) < len(nodes) else None
        x = factor.solve(pushed[loose], np.eye(3 * len(loose)), at)
        found = x[(3 * seen[free, None] + np.arange(3)).ravel()]  # (3 free, 3 loose)
        found = found.reshape(len(free), 3, len(loose), 3).transpose(2, 0, 3, 1)
        values[loose[:, None], free] = found.reshape(len(loose), len(free), 9)
    return values
