"""One contact of a solid: exact columns near the contact, the far field beyond.

The displacement by a contact is that of the far field, corrected near the contact by the columns
under it. The correction counts in full up to `NEAR_FIELD_END` sample spacings from the contact and
falls smoothly to zero at `FAR_FIELD_START`, where columns and far field no longer differ
noticeably. So a tick reads only the nearby rows of a column. The smooth fall also keeps the
displacement continuous while a contact slides over a vertex whose column is missing, and while a
new column fades in.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cohaptic_server.bodies.solid.column_store import ColumnStore
from cohaptic_server.bodies.solid.far_field import FarField
from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.numeric import Floats, Ints

NEAR_FIELD_END = 1.5  # sample spacings from a contact up to which its columns count in full
FAR_FIELD_START = 2.5  # sample spacings beyond which the columns do not count
_EVERYWHERE = (1e6, 2e6)  # m; the same two distances where columns count at any distance
_NEGLIGIBLE = 1e-9  # share of a force that is neglected if its vertices have no columns


@dataclass(frozen=True, eq=False)
class Surroundings:
    """The mesh, columns and far field that all contacts of a solid share.

    Args:
        mesh: Resting surface.
        columns: The solid's columns.
        far_field: The solid's far field.
    """

    mesh: SurfaceMesh
    columns: ColumnStore
    far_field: FarField

    @property
    def reach(self) -> float:
        """Distance from a contact beyond which its columns do not count [m]."""
        return FAR_FIELD_START * self.far_field.spacing

    def by_rank(self, vertices: Ints) -> Ints:
        """Return indices that sort `vertices` (k,) into the order of a column's rows, (k,)."""
        return self.columns.places.rank[vertices].argsort()


@dataclass(frozen=True, eq=False)
class SolidContact:
    """The response to a unit force in any direction on one contact.

    Args:
        around: Mesh, columns and far field.
        vertices: Vertices under the contact, shape (k,).
        weights: Share of the force on each vertex, shape (k,).
        slots: Slots of the stored columns under the contact, shape (s,).
        known: Vertices of these columns, shape (s,).
        known_weights: Share of the force on each vertex in `known`, times the column's fade-in,
            shape (s,).
        centre: Centre of the pressure, shape (3,) [m].
        spread: Share of the force on each sample of the far field, shape (m,).
        far_field: Displacement of the samples per unit force in x, y, z, shape (3, m, 3) [m/N].
    """

    around: Surroundings
    vertices: Ints
    weights: Floats
    slots: Ints
    known: Ints
    known_weights: Floats
    centre: Floats
    spread: Floats
    far_field: Floats

    @classmethod
    def of(
        cls, around: Surroundings, vertices: Ints, weights: Floats, far_field: Floats
    ) -> SolidContact:
        """Compute the response to a unit force from the columns that are stored at present.

        Args:
            around: Mesh, columns and far field.
            vertices: Vertices under the contact, shape (k,).
            weights: Share of the force on each vertex, shape (k,).
            far_field: Receives the displacement of the samples, shape (3, m, 3) [m/N].
        """
        spread = around.far_field.spread(vertices, weights)
        around.far_field.respond(spread, far_field)
        columns = around.columns
        slots, known, fractions = columns.slot[vertices], vertices, weights
        if slots.min(initial=0) < 0:
            found = slots >= 0
            slots, known, fractions = slots[found], vertices[found], weights[found]
        fractions = fractions * columns.fraction[slots]
        centre = weights @ around.mesh.vertices[vertices]
        return cls(around, vertices, weights, slots, known, fractions, centre, spread, far_field)

    @cached_property
    def missing(self) -> float:
        """Share of the force that no column covers; 0 if all columns are stored and faded in."""
        missing = 1.0 - float(self.known_weights.sum())
        return missing if missing > _NEGLIGIBLE else 0.0

    @cached_property
    def _replaced(self) -> Floats:
        """The part of the far field that columns replace, shape (3, m, 3) [m/N]."""
        if not self.missing:
            return self.far_field
        far_field = self.around.far_field
        out = np.empty_like(self.far_field)
        far_field.respond(far_field.spread(self.known, self.known_weights), out)
        return out

    def missing_compliance(self, direction: Floats, smoothed: Floats) -> float:
        """Return the part of the self-compliance that columns and far field lack [m/N].

        Args:
            direction: Unit vector of the force, shape (3,).
            smoothed: Self-compliance by the interpolated far field alone, shape (3, 3) [m/N].
        """
        if not self.missing:
            return 0.0
        whole = self.around.far_field.self_compliance(self.vertices, self.weights, direction)
        return self.missing * max(0.0, whole - float(direction @ smoothed @ direction))

    def correct(self, u: Floats, force: Floats, vertices: Ints, order: Ints) -> None:
        """Replace the far field near the contact by the columns.

        Args:
            u: Displacement of `vertices` by the far field, corrected in place, shape (v, 3) [m].
            force: Force on the contact that `u` contains, shape (3,) [N].
            vertices: Vertices of `u`, shape (v,).
            order: `Surroundings.by_rank` of `vertices`, shape (v,).
        """
        around = self.around
        around.columns.kernel.correct(
            u,
            vertices,
            order,
            self.centre,
            NEAR_FIELD_END * around.far_field.spacing,
            FAR_FIELD_START * around.far_field.spacing,
            self.kinds,
            self.slots,
            self.known_weights,
            force,
            self._replaced,
            around.far_field.near,
            around.far_field.carries,
        )

    def correction_at(self, other: SolidContact) -> Floats:
        """Return how the columns under this contact correct the displacement of `other`.

        Returns:
            Added displacement by 1 N in x, y, z on this contact, averaged over the pressure of
            `other`, shape (3, 3) [m/N].
        """
        far_field = self.around.far_field
        end, start = NEAR_FIELD_END * far_field.spacing, FAR_FIELD_START * far_field.spacing
        block, counted = self._block(other, end, start)
        # The same weights distribute a force and interpolate a displacement.
        spread = far_field.spread(other.vertices, counted)
        replaced = far_field.between(spread[None], self._replaced[None])[0, 0]
        return np.asarray(block - replaced)

    @property
    def own_block(self) -> Floats:
        """Self-compliance from the columns, all of which must be stored, shape (3, 3) [m/N]."""
        return self._block(self, *_EVERYWHERE)[0]

    def _block(self, other: SolidContact, full: float, none: float) -> tuple[Floats, Floats]:
        """Return the displacement of `other` by the columns under this contact, in their range.

        Args:
            other: The displaced contact.
            full: Distance up to which columns count in full [m].
            none: Distance beyond which columns do not count [m].

        Returns:
            Displacement for 1 N in x, y, z, averaged over the pressure, shape (3, 3) [m/N]; and
            the weight of each vertex of `other` in this average, shape (k,).
        """
        block, counted = np.empty(9), np.empty(len(other.vertices))
        self.around.columns.kernel.block(
            other.vertices,
            other.order,
            other.weights,
            self.centre,
            full,
            none,
            self.kinds,
            self.slots,
            self.known_weights,
            counted,
            block,
        )
        return block.reshape(3, 3), counted

    @cached_property
    def order(self) -> Ints:
        """Indices that sort `vertices` into the order of a column's rows, shape (k,)."""
        return self.around.by_rank(self.vertices)

    @cached_property
    def kinds(self) -> Ints:
        """Kind of each stored column under the contact, shape (s,)."""
        return self.around.columns.kind[self.known]
