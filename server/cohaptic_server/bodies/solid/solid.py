"""A linear elastic solid of tetrahedra: an object of any shape, fixed in some region.

    K u = f,    u = 0 at fixed nodes,    C = P' K^-1 P over the surface vertices P

with the displacement u, the forces f, the stiffness K and the compliance C. K is factored once,
sparsely (`cholesky/factor.py`); C is never formed. A tick needs only the columns of C under the
present contacts (`green_columns.py`). Loads and displacements are those of the surface vertices;
with quadratic elements these include the midpoints of edges, so that a contact can press on every
node of the surface.

A solid works in one of two modes. In the first, a solid solves for missing columns within the tick,
and is exact. In the background mode it lists the missing columns, uses its far field until the
columns arrive (`near_field.py`), and never makes a tick wait; the server solves for the columns and
delivers them (`shell/column_worker.py`).

The response to several loads is the superposition of the responses to each. A value is computed
when it is first read.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cohaptic_server.bodies.body import DenseResponse, Load, Response
from cohaptic_server.bodies.solid.column_store import Column
from cohaptic_server.bodies.solid.far_field import FarField, build_far_field
from cohaptic_server.bodies.solid.green_columns import ColumnRequest, GreenColumns
from cohaptic_server.bodies.solid.near_field import FAR_FIELD_START, SolidContact, Surroundings
from cohaptic_server.bodies.solid.parts import SolidParts, factor_of
from cohaptic_server.bodies.solid.shape import Moduli, SolidSettings, shape_of
from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.mesh.tetrahedra import TetMesh
from cohaptic_server.numeric import Floats, Ints, Mask


@dataclass(frozen=True, eq=False)
class SolidResponse:
    """The response of a solid in one tick.

    Args:
        around: Mesh, columns and far field.
        loads: The loads, c of them.
        contacts: The k contacts on which the loads act; several loads may share a contact.
        contact_of: Contact of each load, shape (c,).
        fields: Displacement of the far field's samples per unit force along x, y, z on each
            contact, shape (k, 3, m, 3) [m/N].
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
        """Return the response to `loads` with the columns that are stored at present."""
        number: dict[tuple[int, int], int] = {}
        firsts: list[Load] = []
        contact_of = np.empty(len(loads), dtype=np.int64)
        for i, load in enumerate(loads):
            # The loads of a contact with friction share the same array objects.
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
        """Compliance C between the contacts of the loads, shape (c, c) [m/N]."""
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
        # The two triangles differ if one contact has its columns and another lacks them.
        C = np.asarray(0.5 * (C + C.T))
        numbers: list[int] = of.tolist()
        for i, (load, k) in enumerate(zip(self.loads, numbers, strict=True)):
            C[i, i] += self.contacts[k].missing_compliance(load.direction, smoothed[k, k])
        return C

    def _corrected(self, smoothed: Floats) -> Floats:
        """Return the displacement of each contact by unit forces on each, (k, k, 3, 3) [m/N].

        Args:
            smoothed: The same displacement from the far field alone, shape (k, k, 3, 3) [m/N].
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
        return self.displacement_of(np.arange(len(self.around.mesh.vertices)))

    def displacement_of(self, vertices: Ints) -> Floats:
        """Return the displacement of some vertices, shape (k, 3) [m]."""
        return self._by(self._on_contacts, self._samples, vertices)

    def without(self, loads: slice, forces: Floats, vertices: Ints) -> Floats:
        """Return the displacement of some vertices without some of the loads, shape (k, 3) [m]."""
        left, samples = self._on_contacts.copy(), self._samples
        for i, force in zip(range(len(self.loads))[loads], forces, strict=True):
            k, removed = self.contact_of[i], force * self._directions[i]
            left[k] -= removed
            # Usually one contact of many is left out: subtracting it is cheaper than a new sum.
            samples = self.around.far_field.without(samples, self.fields[k], removed)
        return self._by(left, samples, vertices)

    def _by(self, forces: Floats, samples: Floats, vertices: Ints) -> Floats:
        """Return the displacement of some vertices by forces on the contacts, shape (v, 3) [m].

        Args:
            forces: Force on each contact, shape (k, 3) [N].
            samples: Displacement of the far field's samples by these forces, shape (m, 3) [m].
            vertices: Vertices at which the displacement is computed, shape (v,).
        """
        around = self.around
        u = around.far_field.interpolated(samples, vertices)
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


FADE_IN_TICKS = 15  # ticks until a new column counts in full: a quarter of a second at 60 Hz
# Ticks for which a contact must press a vertex before its column is requested. A sliding finger
# leaves a vertex before its column could arrive, and solving for it would delay the columns of
# resting fingers.
MIN_TOUCH_TICKS = 9
_LONGEST_EDGE = 2.0  # contact radii; more distant corners of a pressed face get little force
_OFF_CENTRE = 1.1  # allowance: on a curved surface a pressure's centre is beside the contact point
_BATCH_RADIUS = 2.0  # contact radii; missing columns this close to the most urgent join its request
MAX_UNDELIVERED = 64  # largest number of delivered columns that wait for a tick, which takes all


class Solid:
    """The linear solid, as a `Body`.

    Args:
        tets: The object at rest.
        fixed: Vertices that do not move, shape (n,).
        settings: Material, elements and contact radius.
        name: Name of the body, shown to users and sent over the network.
        parts: Factor and far field from an earlier preparation; None computes them.
        moduli: Elastic moduli of each tetrahedron; None takes the material of the settings for all
            of them.

    Attributes:
        name: As given.
        mesh: The resting surface.
        contact_radius: Radius of the pressure under a contact [m].
        shape: Nodes, elements and surface.
        columns: Source and store of the Green's functions (columns of C).
        missing: Vertices whose columns are missing in the background mode, most urgent first.
        at_once: Whether a response waits for its columns; False in the background mode.
        linear: True.

    Raises:
        BodyError: No vertices are fixed, too few, or all of them.
    """

    linear = True

    def __init__(
        self,
        tets: TetMesh,
        fixed: Mask,
        settings: SolidSettings | None = None,
        name: str = "solid",
        parts: SolidParts | None = None,
        *,
        moduli: Moduli | None = None,
    ) -> None:
        self.settings = settings or SolidSettings()
        self.name = name
        self.shape = shape_of(tets, fixed, self.settings, moduli) if parts is None else parts.shape
        self.mesh, self.contact_radius = self.shape.mesh, self.shape.contact_radius
        factor = factor_of(self.shape) if parts is None else parts.factor
        self.factor_bytes = factor.bytes
        self.columns = GreenColumns(
            factor, self.shape.free_index, self.mesh.vertices, self.settings.cache
        )
        self._far_field = None if parts is None else parts.far_field
        self.at_once = True
        self._ahead: Ints = np.zeros(0, dtype=np.int64)
        self._delivered: deque[Column] = deque()
        self.missing: Ints = np.zeros(0, dtype=np.int64)

    @property
    def far_field(self) -> FarField:
        """The far field; it is computed on first use unless `parts` contained it."""
        if self._far_field is None:
            self._far_field = build_far_field(
                self.mesh, self.contact_radius, self.columns.factor, self.shape.free_index
            )
        return self._far_field

    def green_source(self) -> SolidGreen:
        """Return the source of the solid's Green's functions, as in `HasGreen`."""
        return SolidGreen(self)

    def in_background(self, *, fill: bool = True) -> None:
        """Switch to the background mode, in which no tick waits for missing columns.

        The server has to deliver the columns of the vertices in `missing`.

        Args:
            fill: Whether to provide the memory for columns now; if not, call
                `columns.store.fill` before the first column is delivered.
        """
        # A contact reads its columns as far as they count, and at all vertices under itself.
        size = self._contact_size()
        reach = size + max(size, FAR_FIELD_START * self.far_field.spacing)
        self.columns.keep(reach, fill=fill)
        self.at_once = False

    def _contact_size(self) -> float:
        """Return the largest distance of a vertex under a contact from the contact's centre [m].

        Pressure on a part of a face loads all corners of the face.
        """
        corners = self.mesh.vertices[self.mesh.faces]
        edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
        longest = min(float(edges.max()), _LONGEST_EDGE * self.contact_radius)
        return _OFF_CENTRE * (self.contact_radius + longest)

    def request(self, limit: int) -> ColumnRequest | None:
        """Return a request for the most urgent missing column and for missing ones close to it.

        Args:
            limit: Largest number of columns.

        Returns:
            The request; None if no column is missing.
        """
        missing, x = self.missing, self.mesh.vertices
        if not len(missing):
            return None
        off = x[missing] - x[missing[0]]
        around = _BATCH_RADIUS * self.contact_radius
        beside = np.einsum("ki,ki->k", off, off) <= around**2
        vertices = missing[beside][:limit]
        return ColumnRequest(vertices, self.columns.store.places_of(vertices))

    def solve_missing(self, limit: int) -> None:
        """Solve for the most urgent missing columns in this thread; a server uses a worker instead.

        Args:
            limit: Largest number of columns.
        """
        request = self.request(limit)
        if request is not None:
            self.deliver(self.columns.solve(request))

    def deliver(self, columns: Iterable[Column]) -> None:
        """Queue columns for the next tick; columns beyond `MAX_UNDELIVERED` are dropped."""
        for column in columns:
            if len(self._delivered) < MAX_UNDELIVERED:
                self._delivered.append(column)

    @property
    def pending(self) -> int:
        """Number of delivered columns that no tick has taken yet."""
        return len(self._delivered)

    def prefetch(self, vertices: Ints) -> None:
        """Announce the vertices that sliding fingers will press soon, shape (k,)."""
        self._ahead = vertices

    def respond(self, loads: Sequence[Load], before: Response | None = None) -> Response:
        """Return the superposition of the fields of the loads; `before` has no effect."""
        del before
        if self.at_once:
            return self._exact(loads)
        store = self.columns.store
        while self._delivered:
            store.put(self._delivered.popleft(), 0.0)
        touched, weights = _touched(loads)
        store.tick(touched, 1.0 / FADE_IN_TICKS)
        order = np.argsort(-weights, kind="stable")
        ahead = self._ahead[store.slot[self._ahead] < 0]
        self.missing = np.concatenate([store.lacking(touched[order], MIN_TOUCH_TICKS), ahead])
        around = Surroundings(self.mesh, store, self.far_field)
        return SolidResponse.of(around, loads, self.contact_radius)

    def _exact(self, loads: Sequence[Load]) -> DenseResponse:
        n, c = len(self.mesh.vertices), len(loads)
        self.columns.ensure(_touched(loads)[0].tolist())
        store = self.columns.store
        fields = np.zeros((c, n, 3))
        for i, load in enumerate(loads):
            whole = store.whole_sums(store.slot[load.vertices], load.weights)
            fields[i] = load.direction @ whole
        C = np.empty((c, c))
        for i, load in enumerate(loads):
            C[i] = fields[:, load.vertices] @ load.direction @ load.weights
        C = 0.5 * (C + C.T)  # removes the asymmetry that single precision causes
        forces = np.array([load.force for load in loads])
        displacement = np.tensordot(forces, fields, axes=1) if loads else np.zeros((n, 3))
        return DenseResponse(displacement, fields, C, 0.5 * float(forces @ C @ forces))

    def vertex_compliance(self) -> Floats:
        """Return the compliance of a contact at each vertex along its normal, shape (n,) [m/N]."""
        return self.far_field.vertex_compliance(self.mesh.normals)


def _touched(loads: Sequence[Load]) -> tuple[Ints, Floats]:
    """Return each vertex under any load once, and its largest weight in a load, (v,) each."""
    if not loads:
        return np.zeros(0, dtype=np.int64), np.zeros(0)
    vertices = np.concatenate([load.vertices for load in loads])
    weights = np.concatenate([load.weights for load in loads])
    unique, index = np.unique(vertices, return_inverse=True)
    largest = np.zeros(len(unique))
    np.maximum.at(largest, index, weights)
    return unique, largest


class SolidGreen:
    """Green's functions of a solid, computed by a solve at each call.

    They do not use the column store, since only ticks may use it.
    """

    def __init__(self, solid: Solid) -> None:
        self._solid = solid

    @property
    def mesh(self) -> SurfaceMesh:
        """The resting surface."""
        return self._solid.mesh

    def green(self, vertex: int) -> Floats:
        """Return the displacement of all vertices per unit force on one, (3, n, 3) [m/N].

        The first axis is the direction of the force: x, y, z.
        """
        forces = np.eye(3)[None]
        return self._solid.columns.respond(np.array([vertex]), forces).reshape(3, -1, 3)

    def identity(self) -> bytes:
        """Return the bytes of the far field, which identify the body without a solve.

        A solve may have to read a factor of a gigabyte; the far field exists already.
        """
        far_field = self._solid.far_field
        return far_field.own.astype("<f4").tobytes() + far_field.compliance.tobytes()
