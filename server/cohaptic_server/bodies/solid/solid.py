"""A linear elastic solid of tetrahedra: any object, held in some region.

    K u = f,    u = 0 where it is held,    C = P' K^-1 P over the surface vertices P

K is factored once, sparsely (`multifrontal.py`); C is never formed. What a tick needs of it are the
columns under the present contacts (`green_columns.py`). Loads and displacements are those of the
surface vertices, the middles of edges too where elements are quadratic: the surface that is touched
has every node of the solid's on it.

A solid either finds the columns that it lacks at once, and is exact; or, in the background, it says
which ones it wants, answers from its coarse twin until they come (`solid_response.py`), and never
makes a tick wait. Who serves it brings the columns (`column_worker.py`).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from cohaptic_server.bodies.body import DenseResponse, Load, Response
from cohaptic_server.bodies.solid.far_field import CoarseTwin, make_twin
from cohaptic_server.bodies.solid.green_columns import Column, GreenColumns, Order
from cohaptic_server.bodies.solid.parts import SolidParts, factor_of
from cohaptic_server.bodies.solid.response import GONE, Pushed, SolidResponse, Spot
from cohaptic_server.bodies.solid.shape import SolidSettings, shape_of
from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.mesh.tetrahedra import TetMesh
from cohaptic_server.numeric import Floats, Ints

RISE = 15  # ticks until a column that came counts in full: a quarter of a second at 60 Hz
# A finger that slides has left a place before its column could be there; to look for it would take
# a core from those who press where they are.
STAYS = 9  # ticks for which a vertex must be touched before its column is wanted
_ROOMY = 1.3  # rows of a column over the most that a place of the twin has round it
MAX_WAITING = 64  # columns that were found and not yet taken; a tick takes all of them


class Solid:
    """The solid behind the `Body` Protocol.

    Args:
        tets: The object at rest.
        held: Which of its vertices do not move, shape (n,) of bool.
        settings: What it is made of.
        name: For people and for the wire.
        parts: What was made of it before; None makes it now.

    Attributes:
        shape: Nodes, elements and surface.
        columns: The Green's functions.
        wanted: Vertices whose columns it lacks, the most urgent first; only in the background.

    Raises:
        BodyError: Nothing is held, too little, or everything.
    """

    def __init__(
        self,
        tets: TetMesh,
        held: npt.NDArray[np.bool_],
        settings: SolidSettings | None = None,
        name: str = "solid",
        parts: SolidParts | None = None,
    ) -> None:
        self.settings = settings or SolidSettings()
        self._name = name
        self.shape = shape_of(tets, held, self.settings) if parts is None else parts.shape
        factor = factor_of(self.shape, self.settings) if parts is None else parts.factor
        self.factor_bytes = factor.bytes
        self.columns = GreenColumns(factor, self.shape.place, self.settings.cache)
        self._twin = None if parts is None else parts.twin
        self._at_once = True
        self._ahead: Ints = np.zeros(0, dtype=np.int64)
        self._spots: dict[int, Spot] = {}
        self._brought: deque[Column] = deque()
        self.wanted: Ints = np.zeros(0, dtype=np.int64)

    @property
    def name(self) -> str:
        """Name for people and for the wire."""
        return self._name

    @property
    def mesh(self) -> SurfaceMesh:
        """The resting surface."""
        return self.shape.mesh

    @property
    def contact_radius(self) -> float:
        """Radius of the pressure under a contact [m]."""
        return self.shape.contact_radius

    @property
    def twin(self) -> CoarseTwin:
        """The solid as seen from afar; made when it is first asked for, if not before."""
        if self._twin is None:
            held = self.shape.place < 0
            self._twin = make_twin(self.mesh, self.contact_radius, self.columns.respond, held)
        return self._twin

    def in_background(self) -> None:
        """From now on a tick does not wait for columns: somebody brings what is `wanted`."""
        reach = self._reach()
        near = self.mesh.tree.query_ball_point(
            self.mesh.vertices[self.twin.places], reach, return_length=True
        )
        longest = int(_ROOMY * np.max(near))
        columns = self.columns
        self.columns = GreenColumns(columns.factor, columns.nodes, self.settings.cache, longest)
        self._at_once = False

    def _reach(self) -> float:
        """How far from the first of an order its columns count [m]."""
        return GONE * self.twin.spacing + 3.0 * self.contact_radius

    def order(self, most: int) -> Order | None:
        """The most urgent place and what is wanted next to it, as far as it counts; or nothing.

        Args:
            most: Columns at once.
        """
        wanted, x, radius = self.wanted, self.mesh.vertices, self.contact_radius
        if not len(wanted):
            return None
        first = x[wanted[0]]
        off = x[wanted] - first
        beside = np.einsum("ki,ki->k", off, off) <= (2.0 * radius) ** 2
        rows = self.mesh.near(first, self._reach())
        if len(rows) > self.columns.length:
            gap = x[rows] - first
            nearest = np.argsort(np.einsum("ki,ki->k", gap, gap))[: self.columns.length]
            rows = np.sort(rows[nearest])
        return Order(wanted[beside][:most], rows)

    def find(self, most: int) -> None:
        """Bring what is most urgent, solved here and now; who serves has it found elsewhere."""
        order = self.order(most)
        if order is not None:
            self.bring(self.columns.solve(order))

    def bring(self, found: Iterable[Column]) -> None:
        """Hand over columns, for the next tick."""
        for column in found:
            if len(self._brought) < MAX_WAITING:
                self._brought.append(column)

    @property
    def waiting(self) -> int:
        """Columns that were brought and not yet taken by a tick."""
        return len(self._brought)

    def expect(self, vertices: Ints) -> None:
        """Say what will be touched soon: what lies ahead of fingers that slide."""
        self._ahead = vertices

    def respond(self, loads: Sequence[Load], before: Response | None = None) -> Response:
        """Superposition of the Green's functions of what is touched; `before` plays no part."""
        del before
        if self._at_once:
            return self._exact(loads)
        while self._brought:
            self.columns.put(self._brought.popleft(), 0.0)
        touched, weights = _touched(loads)
        self.columns.tick(touched, 1.0 / RISE)
        order = np.argsort(-weights, kind="stable")
        ahead = self._ahead[self.columns.slot[self._ahead] < 0]
        self.wanted = np.concatenate([self.columns.lacking(touched[order], STAYS), ahead])
        spots: dict[int, Spot] = {}
        for load in loads:
            if id(load.vertices) not in spots:
                spots[id(load.vertices)] = self._spot(load)
        self._spots = spots
        pushed = [
            Pushed.of(load, self.mesh, self.columns, self.twin, spots[id(load.vertices)])
            for load in loads
        ]
        return SolidResponse(self.mesh, self.columns, self.twin, pushed, self.contact_radius)

    def _spot(self, load: Load) -> Spot:
        """Where a load pushes: of a finger at rest it is the same as in the tick before."""
        spot = self._spots.get(id(load.vertices))
        if spot is None or not spot.holds(load):
            spot = Spot(self.twin.carry(load.vertices, load.weights))
        if spot.own is not None:
            return spot
        own = self.columns.block(load.vertices, load.weights)
        return spot if own is None else replace(spot, own=own)

    def _exact(self, loads: Sequence[Load]) -> DenseResponse:
        n, c = len(self.mesh.vertices), len(loads)
        self.columns.ensure(_touched(loads)[0].tolist())
        every = np.arange(n)
        fields = np.zeros((c, n, 3))
        for i, load in enumerate(loads):
            slots = self.columns.slot[load.vertices]
            fields[i] = self.columns.pull(slots, load.weights, load.direction, every)
        C = np.empty((c, c))
        for i, load in enumerate(loads):
            C[i] = fields[:, load.vertices] @ load.direction @ load.weights
        C = 0.5 * (C + C.T)  # it is symmetric but for the columns' single precision
        forces = np.array([load.force for load in loads])
        displacement = np.tensordot(forces, fields, axes=1) if loads else np.zeros((n, 3))
        return DenseResponse(displacement, fields, C, 0.5 * float(forces @ C @ forces))

    def vertex_compliance(self) -> Floats:
        """C_ii of a contact centred at each vertex, along its normal, shape (n,) [m/N]."""
        return self.twin.table()


def _touched(loads: Sequence[Load]) -> tuple[Ints, Floats]:
    """Every vertex that is touched, once, and the largest share of a load on it."""
    if not loads:
        return np.zeros(0, dtype=np.int64), np.zeros(0)
    vertices = np.concatenate([load.vertices for load in loads])
    weights = np.concatenate([load.weights for load in loads])
    unique, place = np.unique(vertices, return_inverse=True)
    most = np.zeros(len(unique))
    np.maximum.at(most, place, weights)
    return unique, most
