"""A solid under loads: exact near each contact, from its coarse twin beyond.

The displacement that a load makes at x is the sum of the columns under it, as far as they are
there, and of the twin's for the rest of the load. A few distances between the twin's places away
nobody can tell them apart, and the twin's is taken alone: a tick then reads of each column what
lies near. From one to the other it is a smooth way, so that nothing steps where a contact slides
over a vertex whose column is missing, or where a column comes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cohaptic_server.bodies.body import Load
from cohaptic_server.bodies.coarse_twin import CoarseTwin
from cohaptic_server.bodies.green_columns import GreenColumns
from cohaptic_server.bodies.mesh import Floats, Ints, SurfaceMesh

EXACT = 2.0  # distances between places of the twin up to which a column counts in full
GONE = 4.0  # from here on it does not count


@dataclass(frozen=True, eq=False)
class Pushed:
    """One load as the response knows it.

    Args:
        load: It.
        centre: Of its pressure, shape (3,) [m].
        slots: Of the columns under it that are there, shape (s,).
        weights: Shares of the load on these, as far as they count, shape (s,).
        known: Their sum, from 0 to 1.
        rest: Displacement of the twin's places by what has no column, shape (m, 3) [m/N].
        replaced: The same by what has one; what a column is taken for.
        own: Compliance of the contact as the twin has it, over what `field` gives [m/N].
    """

    load: Load
    centre: Floats
    slots: Ints
    weights: Floats
    known: float
    rest: Floats
    replaced: Floats
    own: float

    @classmethod
    def of(cls, load: Load, mesh: SurfaceMesh, columns: GreenColumns, twin: CoarseTwin) -> Pushed:
        """What is there of a load at this moment."""
        slots = columns.slot[load.vertices]
        here = slots >= 0
        weights = np.zeros(len(slots))
        weights[here] = load.weights[here] * columns.share[slots[here]]
        moved = twin.pushed(twin.spread(load.vertices, load.weights - weights), load.direction)
        replaced = np.zeros_like(moved)
        if here.any():
            replaced = twin.pushed(twin.spread(load.vertices, weights), load.direction)
        normal = load.weights @ mesh.normals[load.vertices]
        normal /= np.linalg.norm(normal)
        own = twin.own(load.vertices, load.weights, load.direction, normal)
        smoothed = load.weights @ (twin.at(moved + replaced, load.vertices) @ load.direction)
        return cls(
            load,
            load.weights @ mesh.vertices[load.vertices],
            slots[here],
            weights[here],
            float(weights.sum()),
            moved,
            replaced,
            max(0.0, own - float(smoothed)),
        )


@dataclass(frozen=True, eq=False)
class SolidResponse:
    """What a solid says of a tick, when it is asked.

    Args:
        mesh: Resting surface.
        columns: Of the solid.
        twin: Of the solid.
        pushed: The loads.
    """

    mesh: SurfaceMesh
    columns: GreenColumns
    twin: CoarseTwin
    pushed: Sequence[Pushed]

    @property
    def compliance(self) -> Floats:
        """Between contacts, shape (c, c) [m/N]."""
        return self._compliance

    @cached_property
    def _compliance(self) -> Floats:
        c = len(self.pushed)
        C = np.zeros((c, c))
        ends = np.cumsum([0] + [len(p.load.vertices) for p in self.pushed])
        every = [p.load.vertices for p in self.pushed]
        rows = np.concatenate(every) if every else np.zeros(0, dtype=np.int64)
        for j, pushed in enumerate(self.pushed):
            field = self._field(pushed, rows)
            for i, other in enumerate(self.pushed):
                moved = field[ends[i] : ends[i + 1]] @ other.load.direction
                C[i, j] = other.load.weights @ moved
        # Where one contact's columns are there and another's are not, the two ways differ.
        C = 0.5 * (C + C.T)
        C[np.diag_indices(c)] += [(1.0 - p.known) * p.own for p in self.pushed]
        return C

    @property
    def energy(self) -> float:
        """Stored by the loads [J]."""
        f = np.array([p.load.force for p in self.pushed])
        return 0.5 * float(f @ self.compliance @ f)

    @property
    def displacement(self) -> Floats:
        """Of every vertex, shape (n, 3) [m]."""
        return self._displacement

    @cached_property
    def _displacement(self) -> Floats:
        return self.at(np.arange(len(self.mesh.vertices)))

    def at(self, vertices: Ints) -> Floats:
        """Displacement of some vertices, shape (k, 3) [m]."""
        return self.without(slice(0, 0), np.zeros(0), vertices)

    def without(self, loads: slice, forces: Floats, vertices: Ints) -> Floats:
        """Displacement of some vertices without some of the loads, shape (k, 3) [m]."""
        left = np.array([p.load.force for p in self.pushed])
        left[loads] -= forces
        moved = np.zeros((len(self.twin.places), 3))
        for pushed, force in zip(self.pushed, left.tolist(), strict=True):
            if force:
                moved += force * (pushed.rest + pushed.replaced)
        found = self.twin.at(moved, vertices)
        if not len(vertices):
            return found
        x = self.mesh.vertices[vertices]
        low, high, reach = x.min(axis=0), x.max(axis=0), GONE * self.twin.spacing
        for pushed, force in zip(self.pushed, left.tolist(), strict=True):
            # Most contacts are far from most places: ask the box before all of its vertices.
            inside = (pushed.centre > low - reach) & (pushed.centre < high + reach)
            if force and inside.all():
                self._correct(found, pushed, force, vertices)
        return found

    def _field(self, pushed: Pushed, vertices: Ints) -> Floats:
        """Displacement of some vertices per unit of one load, shape (k, 3) [m/N]."""
        found = self.twin.at(pushed.rest + pushed.replaced, vertices)
        self._correct(found, pushed, 1.0, vertices)
        return found

    def _correct(self, found: Floats, pushed: Pushed, force: float, vertices: Ints) -> None:
        """Put columns in the place of what the twin says near a contact, in `found`."""
        if not len(pushed.slots):
            return
        off = self.mesh.vertices[vertices] - pushed.centre
        distance = np.sqrt(np.einsum("ki,ki->k", off, off)) / self.twin.spacing
        near = np.flatnonzero(distance < GONE)
        if not len(near):
            return
        rows = vertices[near]
        exact = self.columns.pull(pushed.slots, pushed.weights, pushed.load.direction, rows)
        part = np.clip((GONE - distance[near]) / (GONE - EXACT), 0.0, 1.0)
        smooth = part * part * (3.0 - 2.0 * part)
        change = exact - self.twin.at(pushed.replaced, rows)
        found[near] += force * smooth[:, None] * change
