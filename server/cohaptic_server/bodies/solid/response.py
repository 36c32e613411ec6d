"""A solid under loads: exact near each contact, from its coarse twin beyond.

The displacement that a load makes at x is the sum of the columns under it, as far as they are
there, and of the twin's for the rest of the load. A few distances between the twin's places away
nobody can tell them apart, and the twin's is taken alone: a tick then reads of each column what
lies near. From one to the other it is a smooth way, so that nothing steps where a contact slides
over a vertex whose column is missing, or where a column comes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from cohaptic_server.bodies.body import Load
from cohaptic_server.bodies.solid.far_field import Carried, CoarseTwin
from cohaptic_server.bodies.solid.green_columns import GreenColumns
from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.numeric import Floats, Ints

EXACT = 1.5  # distances between places of the twin up to which a column counts in full
GONE = 2.5  # from here on it does not count
_NOTHING = 1e-9  # share of a load that may lack columns without a difference
_REMEMBERED = 32  # places whose nearness to a contact is remembered: more than look at it


class Nearby(NamedTuple):
    """What the columns of one contact change of what the twin says next to it.

    Args:
        asked: Vertices that were asked for.
        near: Those of them that are near, as indices into `asked`, shape (k,).
        change: Of their displacement for a force in x, y, z, shape (k, 3, 3) [m/N].
    """

    asked: Ints
    near: Ints
    change: Floats


@dataclass(frozen=True, eq=False)
class Spot:
    """A contact as long as it stays where it is: what was found of it once.

    Args:
        carried: As the twin has it.
        own: Its compliance at itself by its columns alone, shape (3, 3) [m/N]; None as long as some
            of them are missing.
        nearby: What was found next to it once all columns were there, by the id of what was asked.
            It only saves time.
    """

    carried: Carried
    own: Floats | None = None
    nearby: dict[int, Nearby] = field(default_factory=dict[int, Nearby])

    def holds(self, load: Load) -> bool:
        """Whether this is the place of a load."""
        was = self.carried
        return was.vertices is load.vertices and was.weights is load.weights


@dataclass(frozen=True, eq=False)
class Pushed:
    """One load as the response knows it.

    Args:
        load: It.
        spot: Where it pushes.
        centre: Of its pressure, shape (3,) [m].
        slots: Of the columns under it that are there, shape (s,).
        weights: Shares of the load on these, as far as they count, shape (s,).
        whole: Displacement of the twin's places, shape (m, 3) [m/N].
        replaced: The part of it that is by what has a column: what these are taken for.
        missed: Compliance of the contact, as the contacts round it have it, over what the columns
            and the twin's smooth dent give [m/N].
    """

    load: Load
    spot: Spot
    centre: Floats
    slots: Ints
    weights: Floats
    whole: Floats
    replaced: Floats
    missed: float

    @classmethod
    def of(
        cls,
        load: Load,
        mesh: SurfaceMesh,
        columns: GreenColumns,
        twin: CoarseTwin,
        spot: Spot,
    ) -> Pushed:
        """What is there of a load at this moment."""
        slots = columns.slot[load.vertices]
        here = slots >= 0
        weights = np.zeros(len(slots))
        weights[here] = load.weights[here] * columns.share[slots[here]]
        spread = spot.carried.spread
        whole = np.tensordot(load.direction, spot.carried.moved, axes=(0, 0))
        missing = max(0.0, 1.0 - float(weights.sum()))
        missed, replaced = 0.0, whole
        if missing > _NOTHING:
            spot.nearby.clear()
            replaced = np.zeros_like(whole)
            if here.any():
                known = twin.spread(load.vertices, weights)
                replaced = twin.pushed(known, load.direction)
            normal = load.weights @ mesh.normals[load.vertices]
            normal /= math.sqrt(normal @ normal)
            own = twin.own(load.vertices, load.weights, load.direction, normal)
            missed = missing * max(0.0, own - float(spread @ (whole @ load.direction)))
        centre = load.weights @ mesh.vertices[load.vertices]
        return cls(load, spot, centre, slots[here], weights[here], whole, replaced, missed)

    @property
    def complete(self) -> bool:
        """Whether all of its columns are there and count."""
        return self.replaced is self.whole


@dataclass(frozen=True, eq=False)
class SolidResponse:
    """What a solid says of a tick, when it is asked.

    Args:
        mesh: Resting surface.
        columns: Of the solid.
        twin: Of the solid.
        pushed: The loads.
        radius: Of a contact [m].
    """

    mesh: SurfaceMesh
    columns: GreenColumns
    twin: CoarseTwin
    pushed: Sequence[Pushed]
    radius: float

    @property
    def compliance(self) -> Floats:
        """Between contacts, shape (c, c) [m/N]."""
        return self._compliance

    @cached_property
    def _compliance(self) -> Floats:
        c = len(self.pushed)
        if not c:
            return np.zeros((0, 0))
        directions = np.array([p.load.direction for p in self.pushed])
        spreads = np.array([p.spot.carried.spread for p in self.pushed])
        whole = np.array([p.whole for p in self.pushed])  # (c, m, 3)
        # What the twin carries to a contact is what it carries from it: no vertex is asked.
        carried = np.tensordot(spreads, whole, axes=(1, 1))  # (c, c, 3)
        C: Floats = (carried * directions[:, None, :]).sum(axis=2)
        centres = self._centres
        reach = GONE * self.twin.spacing + self.radius
        for j, pushed in enumerate(self.pushed):
            if not len(pushed.slots):
                continue
            off = centres - pushed.centre
            near = np.flatnonzero(np.einsum("ik,ik->i", off, off) < reach**2)
            for i in near.tolist():
                load = self.pushed[i].load
                if i == j and pushed.spot.own is not None:
                    C[i, i] = load.direction @ pushed.spot.own @ load.direction
                    continue
                change = np.zeros((len(load.vertices), 3))
                self._correct(change, pushed, 1.0, load.vertices)
                C[i, j] += load.weights @ (change @ load.direction)
        # Where one contact's columns are there and another's are not, the two ways differ.
        C = np.asarray(0.5 * (C + C.T))
        C[np.diag_indices(c)] += [p.missed for p in self.pushed]
        return C

    @property
    def energy(self) -> float:
        """Stored by the loads [J]."""
        return 0.5 * float(self._forces @ self.compliance @ self._forces)

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
        left = self._forces.copy()
        left[loads] -= forces
        # Less what is left out, where little is: of all contacts but one, say.
        out = np.flatnonzero(left != self._forces).tolist()
        moved = self._moved
        if out:
            moved = moved - sum((self._forces[i] - left[i]) * self.pushed[i].whole for i in out)
        found = self.twin.at(moved, vertices)
        if not len(vertices):
            return found
        x = self.mesh.vertices[vertices]
        # Most contacts are far from most places: ask the box before all of its vertices.
        beside = np.maximum(
            0.0, np.maximum(x.min(axis=0) - self._centres, self._centres - x.max(axis=0))
        )
        near = np.einsum("ik,ik->i", beside, beside) < (GONE * self.twin.spacing) ** 2
        for i in np.flatnonzero(near & (left != 0.0)).tolist():
            self._correct(found, self.pushed[i], float(left[i]), vertices)
        return found

    @cached_property
    def _forces(self) -> Floats:
        return np.array([p.load.force for p in self.pushed], dtype=np.float64)

    @cached_property
    def _centres(self) -> Floats:
        return np.array([p.centre for p in self.pushed]).reshape(-1, 3)

    @cached_property
    def _moved(self) -> Floats:
        """Displacement of the twin's places by all loads, shape (m, 3) [m]."""
        moved = np.zeros((len(self.twin.places), 3))
        for pushed in self.pushed:
            if pushed.load.force:
                moved += pushed.load.force * pushed.whole
        return moved

    def _correct(self, found: Floats, pushed: Pushed, force: float, vertices: Ints) -> None:
        """Put columns in the place of what the twin says near a contact, in `found`."""
        if not len(pushed.slots):
            return
        if not pushed.complete:
            near, smooth = self._part(pushed, vertices)
            if len(near):
                rows = vertices[near]
                exact = self.columns.pull(pushed.slots, pushed.weights, pushed.load.direction, rows)
                change = exact - self.twin.at(pushed.replaced, rows)
                found[near] += force * smooth[:, None] * change
            return
        nearby = pushed.spot.nearby
        known = nearby.get(id(vertices))
        if known is None or known.asked is not vertices:
            known = self._nearby(pushed, vertices)
            if not vertices.flags.writeable:  # only what cannot change may be asked for again
                if len(nearby) >= _REMEMBERED:
                    nearby.clear()
                nearby[id(vertices)] = known
        if len(known.near):
            found[known.near] += (force * pushed.load.direction) @ known.change

    def _nearby(self, pushed: Pushed, vertices: Ints) -> Nearby:
        """What the columns of a load change at some vertices, whatever the direction."""
        near, smooth = self._part(pushed, vertices)
        rows = vertices[near]
        exact = self.columns.sums(pushed.slots, pushed.weights, rows)
        places = pushed.spot.carried.moved.transpose(1, 0, 2).reshape(len(self.twin.places), 9)
        change = exact - self.twin.at(places, rows).reshape(-1, 3, 3)
        return Nearby(vertices, near, smooth[:, None, None] * change)

    def _part(self, pushed: Pushed, vertices: Ints) -> tuple[Ints, Floats]:
        """Vertices where columns count, and how far they do."""
        off = self.mesh.vertices[vertices] - pushed.centre
        distance = np.sqrt(np.einsum("ki,ki->k", off, off)) / self.twin.spacing
        near = np.flatnonzero(distance < GONE)
        part = np.clip((GONE - distance[near]) / (GONE - EXACT), 0.0, 1.0)
        return near, part * part * (3.0 - 2.0 * part)
