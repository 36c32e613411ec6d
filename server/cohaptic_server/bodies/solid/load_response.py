"""The response of a solid to one load: exact near the contact, the far field beyond.

The displacement under a load is the far field's, corrected near the contact by the columns under
it. The correction counts in full up to `NEAR_FIELD_END` sample spacings from the contact and falls
smoothly to zero at `FAR_FIELD_START`, where the two fields no longer differ noticeably: a tick
reads only the rows of a column that lie near. The fall also keeps the displacement continuous while
a contact slides over a vertex whose column is missing, and while a new column fades in.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from cohaptic_server.bodies.body import Load
from cohaptic_server.bodies.solid.column_store import ColumnStore
from cohaptic_server.bodies.solid.far_field import FarField, SampledContact
from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.numeric import Floats, Ints

NEAR_FIELD_END = 1.5  # sample spacings from a contact up to which its columns count in full
FAR_FIELD_START = 2.5  # sample spacings from which they do not count
_NEGLIGIBLE = 1e-9  # share of a load that may lack columns without an effect
_CACHED = 32  # corrections cached for a contact; fewer vertex sets than this ask for one


class Correction(NamedTuple):
    """The difference between columns and far field near one contact.

    Args:
        vertices: Vertices that were asked for, shape (v,).
        near: Those of them that are near, as indices into `vertices`, shape (k,).
        per_force: Correction of their displacement per unit force along x, y, z,
            shape (k, 3, 3) [m/N].
    """

    vertices: Ints
    near: Ints
    per_force: Floats


@dataclass(frozen=True, eq=False)
class SteadyContact:
    """Values of a contact that stay valid as long as it does not move.

    Args:
        sampled: Its force and displacement in terms of the far field's samples.
        self_compliance: Its compliance at itself by its columns alone, shape (3, 3) [m/N]; None as
            long as some of them are missing.
        corrections: Cache of corrections once all columns are known, by the id of the vertices.
    """

    sampled: SampledContact
    self_compliance: Floats | None = None
    corrections: dict[int, Correction] = field(default_factory=dict[int, Correction])

    def covers(self, load: Load) -> bool:
        """Whether a load acts on exactly this contact."""
        return self.sampled.vertices is load.vertices and self.sampled.weights is load.weights


@dataclass(frozen=True, eq=False)
class LoadResponse:
    """The response to one load, per unit of its force.

    Args:
        load: The applied load.
        contact: The contact on which it acts.
        centre: Centre of its pressure, shape (3,) [m].
        slots: Known columns under it, shape (s,).
        weights: Share of the load on each, times the column's fade-in, shape (s,).
        far_field: Displacement of the samples, shape (m, 3) [m/N].
        replaced: Far-field displacement of the vertices that have exact columns; subtracted before
            those are added, shape (m, 3) [m/N].
        missing_compliance: Self-compliance that columns and far field together underestimate
            [m/N].
    """

    load: Load
    contact: SteadyContact
    centre: Floats
    slots: Ints
    weights: Floats
    far_field: Floats
    replaced: Floats
    missing_compliance: float

    @classmethod
    def of(
        cls,
        load: Load,
        mesh: SurfaceMesh,
        columns: ColumnStore,
        far_field: FarField,
        contact: SteadyContact,
    ) -> LoadResponse:
        """The response by the columns that are known at present."""
        slots = columns.slot[load.vertices]
        known = slots >= 0
        weights = np.zeros(len(slots))
        weights[known] = load.weights[known] * columns.share[slots[known]]
        spread = contact.sampled.spread
        total = np.tensordot(load.direction, contact.sampled.per_force, axes=(0, 0))
        missing = max(0.0, 1.0 - float(weights.sum()))
        missing_compliance, replaced = 0.0, total
        if missing > _NEGLIGIBLE:
            contact.corrections.clear()
            replaced = np.zeros_like(total)
            if known.any():
                replaced = far_field.response(
                    far_field.spread(load.vertices, weights), load.direction
                )
            normal = load.weights @ mesh.normals[load.vertices]
            normal /= math.sqrt(normal @ normal)
            whole = far_field.self_compliance(load.vertices, load.weights, load.direction, normal)
            smoothed = float(spread @ (total @ load.direction))
            missing_compliance = missing * max(0.0, whole - smoothed)
        centre = load.weights @ mesh.vertices[load.vertices]
        return cls(
            load, contact, centre, slots[known], weights[known], total, replaced, missing_compliance
        )

    @property
    def complete(self) -> bool:
        """Whether all of its columns are known and count in full."""
        return self.replaced is self.far_field

    def correct(
        self,
        u: Floats,
        force: float,
        vertices: Ints,
        mesh: SurfaceMesh,
        columns: ColumnStore,
        far_field: FarField,
    ) -> None:
        """Replace the far field near the contact by the columns.

        Args:
            u: Displacement of `vertices` by the far field, corrected in place, shape (v, 3) [m].
            force: Force of the load that `u` contains [N].
            vertices: Shape (v,).
            mesh: Resting surface.
            columns: The solid's columns.
            far_field: The solid's far field.
        """
        if not len(self.slots):
            return
        if not self.complete:
            near, share = self._near(vertices, mesh, far_field)
            if len(near):
                rows = vertices[near]
                exact = columns.displacement(self.slots, self.weights, self.load.direction, rows)
                change = exact - far_field.at(self.replaced, rows)
                u[near] += force * share[:, None] * change
            return
        cache = self.contact.corrections
        correction = cache.get(id(vertices))
        if correction is None or correction.vertices is not vertices:
            correction = self._correction(vertices, mesh, columns, far_field)
            if not vertices.flags.writeable:  # an array that may change cannot be a key
                if len(cache) >= _CACHED:
                    cache.clear()
                cache[id(vertices)] = correction
        if len(correction.near):
            u[correction.near] += (force * self.load.direction) @ correction.per_force

    def _correction(
        self, vertices: Ints, mesh: SurfaceMesh, columns: ColumnStore, far_field: FarField
    ) -> Correction:
        """The correction at some vertices, for any direction of the force."""
        near, share = self._near(vertices, mesh, far_field)
        rows = vertices[near]
        exact = columns.sums(self.slots, self.weights, rows)
        per_force = self.contact.sampled.per_force
        samples = per_force.transpose(1, 0, 2).reshape(len(far_field.samples), 9)
        change = exact - far_field.at(samples, rows).reshape(-1, 3, 3)
        return Correction(vertices, near, share[:, None, None] * change)

    def _near(self, vertices: Ints, mesh: SurfaceMesh, far_field: FarField) -> tuple[Ints, Floats]:
        """Vertices where columns count, as indices, and the share with which they do."""
        off = mesh.vertices[vertices] - self.centre
        distance = np.sqrt(np.einsum("ki,ki->k", off, off)) / far_field.spacing
        near = np.flatnonzero(distance < FAR_FIELD_START)
        width = FAR_FIELD_START - NEAR_FIELD_END
        part = np.clip((FAR_FIELD_START - distance[near]) / width, 0.0, 1.0)
        return near, part * part * (3.0 - 2.0 * part)
