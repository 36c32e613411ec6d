"""A solid under loads: the superposition of the responses to each of them, computed on demand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cohaptic_server.bodies.solid.column_store import ColumnStore
from cohaptic_server.bodies.solid.far_field import FarField
from cohaptic_server.bodies.solid.load_response import FAR_FIELD_START, LoadResponse
from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.numeric import Floats, Ints


@dataclass(frozen=True, eq=False)
class SolidResponse:
    """The response of a solid in one tick.

    Args:
        mesh: Resting surface.
        columns: The solid's columns.
        far_field: The solid's far field.
        loads: The response to each load.
        radius: Contact radius [m].
    """

    mesh: SurfaceMesh
    columns: ColumnStore
    far_field: FarField
    loads: Sequence[LoadResponse]
    radius: float

    @property
    def compliance(self) -> Floats:
        """Contact compliance C, shape (c, c) [m/N]."""
        return self._compliance

    @cached_property
    def _compliance(self) -> Floats:
        c = len(self.loads)
        if not c:
            return np.zeros((0, 0))
        directions = np.array([one.load.direction for one in self.loads])
        spreads = np.array([one.contact.sampled.spread for one in self.loads])
        fields = np.array([one.far_field for one in self.loads])  # (c, m, 3)
        # The same weights distribute a force and interpolate a displacement: no vertex is needed.
        at_contacts = np.tensordot(spreads, fields, axes=(1, 1))  # (c, c, 3)
        C: Floats = (at_contacts * directions[:, None, :]).sum(axis=2)
        centres = self._centres
        reach = FAR_FIELD_START * self.far_field.spacing + self.radius
        for j, source in enumerate(self.loads):
            if not len(source.slots):
                continue
            off = centres - source.centre
            near = np.flatnonzero(np.einsum("ik,ik->i", off, off) < reach**2)
            for i in near.tolist():
                load = self.loads[i].load
                own = source.contact.self_compliance
                if i == j and own is not None:
                    C[i, i] = load.direction @ own @ load.direction
                    continue
                change = np.zeros((len(load.vertices), 3))
                self._correct(change, source, 1.0, load.vertices)
                C[i, j] += load.weights @ (change @ load.direction)
        # The two triangles differ where one contact has its columns and another has not.
        C = np.asarray(0.5 * (C + C.T))
        C[np.diag_indices(c)] += [one.missing_compliance for one in self.loads]
        return C

    @property
    def energy(self) -> float:
        """Energy stored by the loads [J]."""
        return 0.5 * float(self._forces @ self.compliance @ self._forces)

    @property
    def displacement(self) -> Floats:
        """Displacement of every vertex, shape (n, 3) [m]."""
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
        # Usually one load is left out of many: subtract it rather than add the others.
        removed = np.flatnonzero(left != self._forces).tolist()
        samples = self._samples
        if removed:
            samples = samples - sum(
                (self._forces[i] - left[i]) * self.loads[i].far_field for i in removed
            )
        u = self.far_field.at(samples, vertices)
        if not len(vertices):
            return u
        x = self.mesh.vertices[vertices]
        # Most contacts are far from most vertices: test the bounding box first.
        gap = np.maximum(
            0.0, np.maximum(x.min(axis=0) - self._centres, self._centres - x.max(axis=0))
        )
        reach = FAR_FIELD_START * self.far_field.spacing
        near = np.einsum("ik,ik->i", gap, gap) < reach**2
        for i in np.flatnonzero(near & (left != 0.0)).tolist():
            self._correct(u, self.loads[i], float(left[i]), vertices)
        return u

    @cached_property
    def _forces(self) -> Floats:
        return np.array([one.load.force for one in self.loads], dtype=np.float64)

    @cached_property
    def _centres(self) -> Floats:
        return np.array([one.centre for one in self.loads]).reshape(-1, 3)

    @cached_property
    def _samples(self) -> Floats:
        """Displacement of the far field's samples by all loads, shape (m, 3) [m]."""
        u = np.zeros((len(self.far_field.samples), 3))
        for one in self.loads:
            if one.load.force:
                u += one.load.force * one.far_field
        return u

    def _correct(self, u: Floats, source: LoadResponse, force: float, vertices: Ints) -> None:
        source.correct(u, force, vertices, self.mesh, self.columns, self.far_field)
