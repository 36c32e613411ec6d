"""A solid under loads: the superposition of the responses to each contact, computed on demand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cohaptic_server.bodies.body import Load
from cohaptic_server.bodies.solid.near_field import SolidContact, Surroundings
from cohaptic_server.numeric import Floats, Ints


@dataclass(frozen=True, eq=False)
class SolidResponse:
    """The response of a solid in one tick.

    Args:
        around: Mesh, columns and far field.
        loads: The loads, c of them.
        contacts: The contacts on which they act, k of them: several loads may share one.
        contact_of: Contact of each load, shape (c,).
        fields: Displacement of the far field's samples by each contact per unit force along
            x, y, z, shape (k, 3, m, 3) [m/N].
        radius: Contact radius [m].
    """

    around: Surroundings
    loads: Sequence[Load]
    contacts: Sequence[SolidContact]
    contact_of: Ints
    fields: Floats
    radius: float

    @classmethod
    def of(cls, around: Surroundings, loads: Sequence[Load], radius: float) -> SolidResponse:
        """The response by the columns that are known at present."""
        number: dict[tuple[int, int], int] = {}
        firsts: list[Load] = []
        contact_of = np.empty(len(loads), dtype=np.int64)
        for i, load in enumerate(loads):
            # The loads of a contact with friction share its arrays.
            contact_of[i] = number.setdefault((id(load.vertices), id(load.weights)), len(firsts))
            if contact_of[i] == len(firsts):
                firsts.append(load)
        fields = np.empty((len(firsts), 3, len(around.far_field.samples), 3))
        contacts = [
            SolidContact.of(around, load.vertices, load.weights, fields[k])
            for k, load in enumerate(firsts)
        ]
        return cls(around, loads, contacts, contact_of, fields, radius)

    @property
    def compliance(self) -> Floats:
        """Contact compliance C, shape (c, c) [m/N]."""
        return self._compliance

    @cached_property
    def _compliance(self) -> Floats:
        if not self.loads:
            return np.zeros((0, 0))
        D, of = self._directions, self.contact_of
        spreads = np.array([contact.spread for contact in self.contacts])
        smoothed = self.around.far_field.between(spreads, self.fields)
        corrected = self._corrected(smoothed)
        B = corrected[of[:, None], of]  # (c, c, 3, 3), the force's direction first
        C: Floats = ((B * D[:, :, None]).sum(axis=2) * D[:, None, :]).sum(axis=2)
        # The two triangles differ where one contact has its columns and another has not.
        C = np.asarray(0.5 * (C + C.T))
        numbers: list[int] = of.tolist()
        for i, (load, k) in enumerate(zip(self.loads, numbers, strict=True)):
            C[i, i] += self.contacts[k].missing_compliance(load.direction, smoothed[k, k])
        return C

    def _corrected(self, smoothed: Floats) -> Floats:
        """Displacement of each contact by a force on each, shape (k, k, 3, 3) [m/N].

        Args:
            smoothed: The same by the far field alone.
        """
        blocks = smoothed.copy()
        reach = self.around.reach + self.radius
        for j, source in enumerate(self.contacts):
            if not len(source.slots):
                continue
            off = self._centres - source.centre
            for i in np.flatnonzero((off * off).sum(axis=1) < reach**2).tolist():
                if i == j and not source.missing:
                    blocks[i, i] = source.own_block
                else:
                    blocks[i, j] += source.correction_at(self.contacts[i])
        return blocks

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
        return self.at(np.arange(len(self.around.mesh.vertices)))

    def at(self, vertices: Ints) -> Floats:
        """Displacement of some vertices, shape (k, 3) [m]."""
        return self._by(self._on_contacts, self._samples, vertices)

    def without(self, loads: slice, forces: Floats, vertices: Ints) -> Floats:
        """Displacement of some vertices without some of the loads, shape (k, 3) [m]."""
        left, samples = self._on_contacts.copy(), self._samples
        for i, force in zip(range(len(self.loads))[loads], forces, strict=True):
            k, removed = self.contact_of[i], force * self._directions[i]
            left[k] -= removed
            # Usually one contact is left out of many: subtract it rather than add the others.
            samples = self.around.far_field.without(samples, self.fields[k], removed)
        return self._by(left, samples, vertices)

    def _by(self, forces: Floats, samples: Floats, vertices: Ints) -> Floats:
        """Displacement of some vertices, shape (v, 3) [m].

        Args:
            forces: On each contact, shape (k, 3) [N].
            samples: Displacement of the far field's samples by them, shape (m, 3) [m].
            vertices: Shape (v,).
        """
        around = self.around
        u = around.far_field.at(samples, vertices)
        found = np.empty(len(self.contacts), dtype=np.int64)
        # Most contacts are far from most vertices.
        count = around.columns.kernel.reachable(vertices, self._centres, around.reach, found)
        order: Ints | None = None
        near: list[int] = found[:count].tolist()
        for k in near:
            if len(self.contacts[k].slots) and forces[k].any():
                order = around.by_rank(vertices) if order is None else order
                self.contacts[k].correct(u, forces[k], vertices, order)
        return u

    @cached_property
    def _directions(self) -> Floats:
        return np.array([load.direction for load in self.loads]).reshape(-1, 3)

    @cached_property
    def _forces(self) -> Floats:
        return np.array([load.force for load in self.loads], dtype=np.float64)

    @cached_property
    def _centres(self) -> Floats:
        return np.array([contact.centre for contact in self.contacts]).reshape(-1, 3)

    @cached_property
    def _on_contacts(self) -> Floats:
        """Force on each contact, shape (k, 3) [N]."""
        forces = np.zeros((len(self.contacts), 3))
        np.add.at(forces, self.contact_of, self._forces[:, None] * self._directions)
        return forces

    @cached_property
    def _samples(self) -> Floats:
        """Displacement of the far field's samples by all loads, shape (m, 3) [m]."""
        m = len(self.around.far_field.samples)
        return (self._on_contacts.ravel() @ self.fields.reshape(-1, 3 * m)).reshape(m, 3)
