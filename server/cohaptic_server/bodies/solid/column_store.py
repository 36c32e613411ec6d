"""A bounded store of Green's columns: slots in one slab of memory, least recently used ones go.

The columns lie in one slab of single precision, bounded in bytes, so that a tick gathers from all
of them at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cohaptic_server.numeric import Floats, Ints, Narrow

MIN_CAPACITY = 256  # columns, whatever the budget: more than one tick of a full room touches
_PROTECTED = 4  # ticks after its last use during which a column stays: a response may still read it


@dataclass(frozen=True, eq=False)
class Column:
    """Displacement of surface vertices for unit forces on one of them.

    Args:
        vertex: The vertex with the unit force.
        rows: Vertices whose displacement is known, rising, shape (k,).
        values: For a force in x, y, z: displacement in x, y, z; shape (k, 9) [m/N].
    """

    vertex: int
    rows: Ints
    values: Narrow


class ColumnStore:
    """The columns of one solid that are known at present.

    Args:
        vertices: Number of surface vertices, n.
        budget: Memory for columns [bytes].
        length: Largest number of rows of a column; n if not given.

    Attributes:
        vertices: As given.
        length: Rows for which a slot has room.
        column_bytes: Memory of one column.
        capacity: Number of slots.
        slot: Slot of each vertex's column, -1 for none, shape (n,).
        share: Fade-in of each slot, from 0 for a new column to 1, shape (capacity,).
    """

    def __init__(self, vertices: int, budget: int, length: int | None = None) -> None:
        self.vertices = vertices
        self.length = vertices if length is None else min(length, vertices)
        short = self.length < vertices
        self.column_bytes = 36 * self.length + (4 * vertices if short else 0)
        self.capacity = max(min(MIN_CAPACITY, vertices), min(budget // self.column_bytes, vertices))
        self._allocate()

    def _allocate(self) -> None:
        n = self.vertices
        self.slot: Ints = np.full(n, -1, dtype=np.int64)
        # Whole columns are not filled: the system gives memory as they come.
        self._slab = np.empty((self.capacity, self.length, 9), dtype=np.float32)
        # Row of each vertex within a column; not needed where columns have all vertices.
        # Columns of one request share such a table, so that a tick reads it from the cache.
        short = self.length < n
        if short:
            self._slab.fill(0.0)  # a tick has no time for the system to find memory
        kind = np.uint16 if self.length <= np.iinfo(np.uint16).max else np.int32
        self._row = np.zeros((self.capacity if short else 0, n), kind)
        self._table = np.full(self.capacity, -1, dtype=np.int64)  # of each slot
        self._rows_of: dict[int, Ints] = {}  # rows of each table that some slot uses
        self.share = np.zeros(self.capacity)
        self._vertex = np.full(self.capacity, -1, dtype=np.int64)  # of each slot
        self._last_use = np.full(self.capacity, -_PROTECTED - 1, dtype=np.int64)
        self._now = 0
        self._touched_since = np.zeros(n, dtype=np.int64)
        self._last_touch = np.full(n, -1, dtype=np.int64)

    @property
    def kept(self) -> int:
        """Number of columns in the store."""
        return int((self._vertex >= 0).sum())

    def grow(self, capacity: int) -> None:
        """Make room for `capacity` columns; if there was less, the store is empty afterwards."""
        if capacity > self.capacity:
            self.capacity = capacity
            self._allocate()

    def tick(self, touched: Ints, step: float) -> None:
        """Begin a tick.

        Args:
            touched: Vertices that are touched in this tick.
            step: Growth of every column's share.
        """
        self._now += 1
        # A vertex that was not touched in the previous tick is touched anew.
        anew = touched[self._last_touch[touched] < self._now - 1]
        self._touched_since[anew] = self._now
        self._last_touch[touched] = self._now
        slots = self.slot[touched]
        self._last_use[slots[slots >= 0]] = self._now
        np.minimum(1.0, self.share + step, out=self.share)

    def lacking(self, vertices: Ints, ticks: int) -> Ints:
        """Those of `vertices` without a column that have been touched for at least `ticks`."""
        lasting = self._now - self._touched_since[vertices] >= ticks
        return vertices[lasting & (self.slot[vertices] < 0)]

    def put(self, column: Column, share: float, protected: int = _PROTECTED) -> bool:
        """Store a column in place of the least recently used one.

        Args:
            column: A column of at most `length` rows.
            share: Its share at first.
            protected: Ticks after its last use during which a column must stay.

        Returns:
            Whether the column is in the store; it is not where all others are in use.
        """
        if self.slot[column.vertex] >= 0:
            return True
        slot = int(self._last_use.argmin())
        previous = self._vertex[slot]
        if previous >= 0:
            if self._last_use[slot] >= self._now - protected:
                return False
            self.slot[previous] = -1
        if len(self._row):
            self._set_table(slot, column.rows)
            self._slab[slot, : len(column.rows)] = column.values
        else:
            if len(column.rows) < self.vertices:
                self._slab[slot] = 0.0  # vertices outside of the request are too far away to count
            self._slab[slot, column.rows] = column.values
        self._vertex[slot], self.slot[column.vertex] = column.vertex, slot
        self.share[slot], self._last_use[slot] = share, self._now
        return True

    def _set_table(self, slot: int, rows: Ints) -> None:
        """Give a slot the table of its rows, shared with the other columns of the same request."""
        previous = int(self._table[slot])
        self._table[slot] = -1
        if previous >= 0 and not (self._table == previous).any():
            del self._rows_of[previous]
        table = next((k for k, known in reversed(self._rows_of.items()) if known is rows), None)
        if table is None:
            table = next(k for k in range(self.capacity) if k not in self._rows_of)
            self._row[table, rows] = np.arange(len(rows))
            self._rows_of[table] = rows
        self._table[slot] = table

    def self_compliance(self, vertices: Ints, weights: Floats) -> Floats | None:
        """Compliance of a contact at itself in all directions.

        Args:
            vertices: Vertices under the contact, shape (k,).
            weights: Share of the force on each, shape (k,).

        Returns:
            Shape (3, 3) [m/N]; None where a column is missing or still fading in.
        """
        slots = self.slot[vertices]
        if (slots < 0).any() or (self.share[slots] < 1.0).any():
            return None
        return np.asarray(np.tensordot(weights, self.sums(slots, weights, vertices), axes=(0, 0)))

    def displacement(self, slots: Ints, weights: Floats, direction: Floats, rows: Ints) -> Floats:
        """Displacement of some vertices per unit force, shape (k, 3) [m/N].

        Args:
            slots: Columns under the force, shape (s,).
            weights: Share of the force on each, shape (s,).
            direction: Unit vector of the force, shape (3,).
            rows: Vertices, shape (k,).
        """
        return np.asarray(direction @ self.sums(slots, weights, rows))

    def sums(self, slots: Ints, weights: Floats, rows: Ints) -> Floats:
        """As `displacement`, for forces along x, y, z: shape (k, 3, 3) [m/N]."""
        narrow = weights.astype(np.float32)
        if not len(self._row) and len(rows) * 2 > self.vertices:
            whole = np.zeros((self.vertices, 9), dtype=np.float32)
            for slot, weight in zip(slots.tolist(), narrow.tolist(), strict=True):
                whole += np.float32(weight) * self._slab[slot]
            sums = whole[rows]
        else:
            # One index into the flat slab takes half of the time of two.
            positions = rows
            if len(self._row):
                offsets = self._table[slots, None] * self.vertices
                positions = self._row.ravel().take(offsets + rows, mode="clip").astype(np.int64)
            flat = self._slab.reshape(-1, 9)
            index = slots[:, None] * self.length + positions
            values = flat.take(index.ravel(), 0, mode="clip")
            sums = narrow @ values.reshape(len(slots), -1)
        return sums.reshape(-1, 3, 3).astype(np.float64)
