"""A bounded store of Green's columns: a new column takes the slot of the least recently used.

All slots lie in one array of single precision, the slab. A column stores its rows place after place
(`places.py`), so that a contact reads the rows round it in runs.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cohaptic_server.bodies.solid.near_field_kernels import NearFieldKernel
from cohaptic_server.bodies.solid.places import PLACE, Places, Positions
from cohaptic_server.numeric import Floats, Ints, Narrow

MIN_CAPACITY = 256  # columns at any budget: more than the contacts of a full room need in one tick
_PROTECTED = 4  # ticks for which a column stays after its last use: a response may still read it
_PLACE_BYTES = 36 * PLACE


@dataclass(frozen=True, eq=False)
class Column:
    """Displacement of surface vertices for unit forces on one vertex.

    Args:
        vertex: The vertex with the unit force.
        places: Places (`places.py`) whose vertices have values, rising, shape (q,).
        values: Displacement in x, y, z for a force in x, y, z, at each vertex of these places,
            shape (q, PLACE * 9) [m/N].
    """

    vertex: int
    places: Ints
    values: Narrow


class ColumnStore:
    """The columns of one solid that have been solved for and are in memory.

    Args:
        points: The surface vertices, shape (n, 3) [m].
        places: Places of the surface vertices.
        budget: Memory for columns [bytes].
        reach: Distance from a vertex up to which its column is stored [m]; None stores whole
            columns.
        fill: Whether to have the system provide the slab's memory at once. If not, call `fill`
            before the first column is stored: a tick has no time to wait for the memory.

    Attributes:
        places: As given.
        kernel: Loops that sum the columns in the slab.
        kind: Kind of each vertex's column, shape (n,); columns of one kind store the same places.
        column_bytes: Memory of one column [bytes].
        capacity: Number of slots.
        slot: Slot of each vertex's column, -1 if there is no column, shape (n,).
        fraction: Fade-in of each slot, from 0 for a new column to 1, shape (capacity,).
    """

    def __init__(
        self,
        points: Floats,
        places: Places,
        budget: int,
        reach: float | None = None,
        *,
        fill: bool = True,
    ) -> None:
        n = len(points)
        self.places, self._points = places, points
        # The columns of all vertices of a place store the same places: a contact then looks up the
        # position of a row in few tables, which stay in the cache.
        self.kind: Ints = np.zeros(n, dtype=np.int64) if reach is None else places.rank // PLACE
        every = np.arange(places.count)
        self._kept_places = [every] if reach is None else places.within(reach)
        self._position: Positions = np.full((len(self._kept_places), places.count), -1, np.int16)
        for kind, found in enumerate(self._kept_places):
            self._position[kind, found] = np.arange(len(found))
        self._length = max(len(found) for found in self._kept_places)
        self.column_bytes = _PLACE_BYTES * self._length
        self.capacity = max(min(MIN_CAPACITY, n), min(budget // self.column_bytes, n))
        self._allocate()
        # For whole columns the system may provide the memory as the columns come.
        if fill and reach is not None:
            self.fill()

    def fill(self) -> None:
        """Have the system provide the memory of the slab; call before any column is stored.

        Hundreds of megabytes take half a second. Another thread than that of the ticks may call
        this: the call releases the interpreter's lock, and writes nothing but the slab.
        """
        self._slab.fill(0.0)

    def _allocate(self) -> None:
        n = len(self._points)
        self.slot: Ints = np.full(n, -1, dtype=np.int64)
        self._slab: Narrow = np.empty((self.capacity, 9 * PLACE * self._length), dtype=np.float32)
        self.kernel = NearFieldKernel(self._points, self.places.rank, self._slab, self._position)
        self.fraction: Floats = np.zeros(self.capacity)
        self._vertex = np.full(self.capacity, -1, dtype=np.int64)  # vertex of each slot's column
        self._last_use = np.full(self.capacity, -_PROTECTED - 1, dtype=np.int64)
        self._now = 0
        self._touched_since = np.zeros(n, dtype=np.int64)
        self._last_touch = np.full(n, -1, dtype=np.int64)

    @property
    def kept(self) -> int:
        """Number of columns in the store."""
        return int((self._vertex >= 0).sum())

    def grow(self, capacity: int) -> None:
        """Provide slots for `capacity` columns; a store that has to grow loses all its columns."""
        if capacity > self.capacity:
            self.capacity = capacity
            self._allocate()

    def tick(self, touched: Ints, step: float) -> None:
        """Begin a tick: note which vertices contacts press, and fade in all columns further.

        Args:
            touched: Vertices under the contacts of this tick.
            step: Growth of every column's fade-in share.
        """
        self._now += 1
        # The time of a vertex starts anew if no contact pressed it in the previous tick.
        anew = touched[self._last_touch[touched] < self._now - 1]
        self._touched_since[anew] = self._now
        self._last_touch[touched] = self._now
        slots = self.slot[touched]
        self._last_use[slots[slots >= 0]] = self._now
        np.minimum(1.0, self.fraction + step, out=self.fraction)

    def lacking(self, vertices: Ints, ticks: int) -> Ints:
        """Return those of `vertices` without a column that contacts have pressed for long enough.

        Args:
            vertices: Vertices under the contacts of this tick, shape (k,).
            ticks: Smallest number of ticks for which a vertex must have been pressed.
        """
        lasting = self._now - self._touched_since[vertices] >= ticks
        return vertices[lasting & (self.slot[vertices] < 0)]

    def places_of(self, vertices: Ints) -> Ints:
        """Return all places that the columns of some vertices (k,) store, rising, shape (q,)."""
        kinds: list[int] = np.unique(self.kind[vertices]).tolist()
        return np.unique(np.concatenate([self._kept_places[kind] for kind in kinds]))

    def put(self, column: Column, fraction: float, protected: int = _PROTECTED) -> bool:
        """Store a column in place of the least recently used one.

        Args:
            column: Column to store. Only places within the store's reach are stored; places that
                the column lacks are set to 0.
            fraction: Initial fade-in share.
            protected: Number of ticks for which a column must stay after its last use.

        Returns:
            Whether the column is in the store; False if every stored column must stay.
        """
        if self.slot[column.vertex] >= 0:
            return True
        slot = int(self._last_use.argmin())
        previous = self._vertex[slot]
        if previous >= 0:
            if self._last_use[slot] >= self._now - protected:
                return False
            self.slot[previous] = -1
        self._fill(slot, column)
        self._vertex[slot], self.slot[column.vertex] = column.vertex, slot
        self.fraction[slot], self._last_use[slot] = fraction, self._now
        return True

    def _fill(self, slot: int, column: Column) -> None:
        wanted = self._kept_places[int(self.kind[column.vertex])]
        rows = self._slab[slot].reshape(self._length, -1)[: len(wanted)]
        at = np.minimum(np.searchsorted(column.places, wanted), len(column.places) - 1)
        # With mode="clip", numpy writes the rows directly into `out`, without a buffer.
        np.take(column.values, at, axis=0, out=rows, mode="clip")
        lacking = column.places[at] != wanted
        if lacking.any():
            rows[lacking] = 0.0

    def whole_sums(self, slots: Ints, weights: Floats) -> Floats:
        """Return the displacement of all vertices by a force, from whole columns.

        Args:
            slots: Slots of the columns under a force, shape (s,).
            weights: Share of the force on each column, shape (s,).

        Returns:
            Displacement for a force of 1 N in x, y, z, shape (n, 3, 3) [m/N].
        """
        total = np.zeros(self._slab.shape[1], dtype=np.float32)
        for slot, weight in zip(slots.tolist(), weights.astype(np.float32), strict=True):
            total += weight * self._slab[slot]
        return total.reshape(-1, 3, 3)[self.places.rank].astype(np.float64)
