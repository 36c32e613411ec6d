"""Loops over the columns near a contact; compiled where there is a compiler (`.pxd`).

The loops do not check indices: vertices, slots and weights come from the server itself.
"""

from __future__ import annotations

import math

import numpy as np

from cohaptic_server.bodies.solid.places import Positions
from cohaptic_server.numeric import Floats, Ints, Narrow

# `PLACE` of `places.py`, repeated as a constant of the compiled code.
_PLACE = 32
# Number of columns that are read into the cache before they are summed, as many as fit into the
# nearest cache. Rows of different columns are far apart in memory. Waiting for each row would leave
# memory idle most of the time: a sum of 100 rows of 70 columns takes 178 us, but 47 us with reading
# ahead (docs/design/solid.md).
_AHEAD = 8
_FAR = 1e9  # m; farther from the origin than any vertex


class NearFieldKernel:
    """Sums the columns under a contact, and replaces the far field near the contact by the sums.

    Args:
        points: Resting positions of all vertices, shape (n, 3) [m].
        rank: Position of each vertex in the order of a column's rows, shape (n,).
        slab: Columns, each place after place, shape (capacity, places * 32 * 9) [m/N].
        position: Position of each place in a column of each kind, -1 if columns of that kind lack
            the place, shape (kinds, p).

    Attributes:
        rows_read: Total number of column rows that have been summed.
    """

    def __init__(self, points: Floats, rank: Ints, slab: Narrow, position: Positions) -> None:
        n = len(points)
        self.points = points
        self.rank = rank
        self.slab = slab
        self.position = position
        self.rows_read = 0
        # Scratch for one sum at all vertices.
        self.index = np.empty(n, dtype=np.int64)
        self.fraction = np.empty(n)
        self.sums = np.empty(9 * n, dtype=np.float32)
        self.runs = np.empty((n, 4), dtype=np.int64)
        self.ahead = np.empty(1, dtype=np.float32)

    def reachable(self, vertices: Ints, centres: Floats, reach: float, out: Ints) -> int:
        """Find the contacts within reach of the bounding box of some vertices.

        Args:
            vertices: Vertices in the box, shape (v,).
            centres: Centres of the contacts, shape (k, 3) [m].
            reach: Distance from the box [m].
            out: Receives the indices of the contacts within `reach`, shape (k,).

        Returns:
            Number of these contacts.
        """
        left = front = low = _FAR
        right = back = high = -_FAR
        for i in range(vertices.shape[0]):
            v = vertices[i]
            left, right = min(left, self.points[v, 0]), max(right, self.points[v, 0])
            front, back = min(front, self.points[v, 1]), max(back, self.points[v, 1])
            low, high = min(low, self.points[v, 2]), max(high, self.points[v, 2])
        found = 0
        for k in range(centres.shape[0]):
            x = max(0.0, left - centres[k, 0], centres[k, 0] - right)
            y = max(0.0, front - centres[k, 1], centres[k, 1] - back)
            z = max(0.0, low - centres[k, 2], centres[k, 2] - high)
            if x * x + y * y + z * z < reach * reach:
                out[found] = k
                found += 1
        return found

    def correct(
        self,
        u: Floats,
        vertices: Ints,
        order: Ints,
        centre: Floats,
        full: float,
        none: float,
        kinds: Ints,
        slots: Ints,
        weights: Floats,
        force: Floats,
        replaced: Floats,
        near: Ints,
        carries: Floats,
    ) -> None:
        """Replace the far field near a contact by the columns under the contact.

        Args:
            u: Displacement of vertices by the far field, corrected in place, shape (v, 3) [m].
            vertices: Vertices of `u`, shape (v,).
            order: Positions in `vertices`, by rank, shape (v,).
            centre: Centre of the contact, shape (3,) [m].
            full: Distance from `centre` up to which columns count in full [m].
            none: Distance from `centre` beyond which columns do not count [m].
            kinds: Kind of each column, shape (s,).
            slots: Slots of the columns under the contact, shape (s,).
            weights: Share of the force on each column, shape (s,).
            force: Force on the contact, shape (3,) [N].
            replaced: Part of the far field that the columns replace: displacement of the samples by
                unit forces on the vertices of these columns, shape (3, m, 3) [m/N].
            near: Samples round each vertex, shape (n, k).
            carries: Share of each of these samples in the vertex's displacement, shape (n, k).
        """
        count = self._find(vertices, order, centre, full, none)
        self._add(vertices, count, kinds, slots, weights)
        f, g, h = force[0], force[1], force[2]
        for r in range(count):
            i = self.index[r]
            v = vertices[i]
            for b in range(3):
                change = (
                    f * self.sums[9 * r + b]
                    + g * self.sums[9 * r + 3 + b]
                    + h * self.sums[9 * r + 6 + b]
                )
                for j in range(near.shape[1]):
                    p = near[v, j]
                    change -= carries[v, j] * (
                        f * replaced[0, p, b] + g * replaced[1, p, b] + h * replaced[2, p, b]
                    )
                u[i, b] += self.fraction[r] * change

    def block(
        self,
        vertices: Ints,
        order: Ints,
        pressure: Floats,
        centre: Floats,
        full: float,
        none: float,
        kinds: Ints,
        slots: Ints,
        weights: Floats,
        counted: Floats,
        out: Floats,
    ) -> None:
        """Average the summed columns over a pressure, with the weight of columns at each vertex.

        That weight is 1 near the contact of the columns and falls to 0 far from it.

        Args:
            vertices: Vertices under the pressure, shape (v,).
            order: Positions in `vertices`, by rank, shape (v,).
            pressure: Share of each of these vertices in the pressure, shape (v,).
            centre: Centre of the contact with the columns, shape (3,) [m].
            full: Distance from `centre` up to which columns count in full [m].
            none: Distance from `centre` beyond which columns do not count [m].
            kinds: Kind of each column, shape (s,).
            slots: Slots of the columns under the contact, shape (s,).
            weights: Share of the force on each column, shape (s,).
            counted: Receives the share of each of `vertices` in the pressure times the weight with
                which columns count at that vertex, shape (v,).
            out: Receives displacement in x, y, z for a force in x, y, z, shape (9,) [m/N].
        """
        count = self._find(vertices, order, centre, full, none)
        self._add(vertices, count, kinds, slots, weights)
        for i in range(counted.shape[0]):
            counted[i] = 0.0
        for c in range(9):
            out[c] = 0.0
        for r in range(count):
            i = self.index[r]
            counted[i] = pressure[i] * self.fraction[r]
            for c in range(9):
                out[c] += counted[i] * self.sums[9 * r + c]

    def _find(self, vertices: Ints, order: Ints, centre: Floats, full: float, none: float) -> int:
        """Find the vertices at which a contact's columns count, by rank; return their number."""
        found = 0
        for k in range(order.shape[0]):
            i = order[k]
            v = vertices[i]
            x = self.points[v, 0] - centre[0]
            y = self.points[v, 1] - centre[1]
            z = self.points[v, 2] - centre[2]
            square = x * x + y * y + z * z
            if square < none * none:
                part = min(1.0, (none - math.sqrt(square)) / (none - full))
                self.index[found] = i
                self.fraction[found] = part * part * (3.0 - 2.0 * part)
                found += 1
        return found

    def _add(self, vertices: Ints, count: int, kinds: Ints, slots: Ints, weights: Floats) -> None:
        """Sum the columns at the vertices that `_find` found."""
        for j in range(9 * count):
            self.sums[j] = 0.0
        number = self._find_runs(vertices, count)
        total = slots.shape[0] if count > 0 else 0
        self.rows_read += count * total
        for s in range(total):
            if s % _AHEAD == 0:
                for t in range(s, min(s + _AHEAD, total)):
                    self._read(slots[t], kinds[t], number)
            slot = slots[s]
            kind = kinds[s]
            weight = weights[s]
            for i in range(number):
                at = self.position[kind, self.runs[i, 2]]
                if at >= 0:
                    first = self.runs[i, 0]
                    shift = 9 * _PLACE * at + self.runs[i, 3] - first
                    for j in range(first, self.runs[i, 1]):
                        self.sums[j] += weight * self.slab[slot, shift + j]

    def _find_runs(self, vertices: Ints, count: int) -> int:
        """Find runs of rows that lie side by side in a column; return the number of runs.

        `runs` receives for each run the first and end position in the sums, the place, and the
        offset of the run in the place.
        """
        number = 0
        first = 0
        while first < count:
            rank = self.rank[vertices[self.index[first]]]
            place = rank // _PLACE
            end = first + 1
            while (
                end < count
                and self.rank[vertices[self.index[end]]] == rank + end - first
                and rank + end - first < (place + 1) * _PLACE
            ):
                end += 1
            self.runs[number, 0] = 9 * first
            self.runs[number, 1] = 9 * end
            self.runs[number, 2] = place
            self.runs[number, 3] = 9 * (rank - place * _PLACE)
            number += 1
            first = end
        return number

    def _read(self, slot: int, kind: int, number: int) -> None:
        """Read one value per cache line of the runs in a column, so that the cache holds them."""
        total = self.ahead[0]
        for i in range(number):
            at = self.position[kind, self.runs[i, 2]]
            if at >= 0:
                j = 9 * _PLACE * at + self.runs[i, 3]
                end = j + self.runs[i, 1] - self.runs[i, 0]
                while j < end:
                    total += self.slab[slot, j]
                    j += 16
                total += self.slab[slot, end - 1]
        # The sum is stored, so that the compiler cannot drop the reads.
        self.ahead[0] = total * 0.0
