"""A linear elastic solid of tetrahedra: any object, held in some region.

    K u = f,    u = 0 where it is held,    C = P' K^-1 P over the surface vertices P

K is factored once, sparsely (`multifrontal.py`); C is never formed. What a tick needs of it are the
columns under the present contacts (`green_columns.py`). Loads and displacements are those of the
surface vertices, the middles of edges too where elements are quadratic: the surface that is touched
has every node of the solid's on it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy.sparse as sp

from cohaptic.errors import BodyError, SettingError
from cohaptic_server.bodies.body import DenseResponse, Load, Response
from cohaptic_server.bodies.elements import stiffness
from cohaptic_server.bodies.green_columns import GreenColumns
from cohaptic_server.bodies.mesh import Floats, Ints, SurfaceMesh
from cohaptic_server.bodies.multifrontal import Factor
from cohaptic_server.bodies.rigid import rigid_rank
from cohaptic_server.bodies.survey import survey
from cohaptic_server.bodies.tetrahedra import (
    EDGES,
    TetMesh,
    boundary,
    quadratic,
    quadratic_boundary,
)

FINGERTIP = 0.008  # m; radius of the pressure under a finger


@dataclass(frozen=True, slots=True)
class SolidSettings:
    """What a solid is made of.

    Args:
        young: E [Pa]; soft tissue has 1e3 to 1e5, rubber 1e6.
        nu: Poisson's ratio.
        contact_radius: Of the pressure under a contact [m]; 0 takes a fingertip's, or more where
            the mesh is too coarse for it.
        order: 1 for linear tetrahedra, 2 for quadratic ones (docs/decisions/0013).
        cache: Memory for Green's functions [bytes].
    """

    young: float = 2e4
    nu: float = 0.45
    contact_radius: float = 0.0
    order: int = 2
    cache: int = 2**30

    def __post_init__(self) -> None:
        if not 10.0 <= self.young <= 1e12:
            raise SettingError("Young's modulus", f"{self.young:g} Pa", "from 10 to 1e12 Pa")
        if not 0.0 <= self.nu <= 0.499:
            why = "from 0 to 0.499: at 0.5 nothing can be squeezed and the stiffness is infinite"
            raise SettingError("Poisson's ratio", self.nu, why)
        if self.contact_radius != 0.0 and not 1e-4 <= self.contact_radius <= 0.5:
            raise SettingError("contact radius", self.contact_radius, "from 0.0001 to 0.5 m")
        if self.order not in (1, 2):
            raise SettingError("order of the elements", self.order, "1 or 2")
        if not 2**20 <= self.cache <= 2**38:
            raise SettingError("cache for columns", f"{self.cache} bytes", "from 1 MiB to 256 GiB")


class Solid:
    """The solid behind the `Body` Protocol.

    Args:
        tets: The object at rest.
        held: Which of its vertices do not move, shape (n,) of bool.
        settings: What it is made of.
        name: For people and for the wire.

    Attributes:
        stiffness: Of all nodes, nothing held, shape (3 nodes, 3 nodes) [N/m].
        elements: Nodes of each tetrahedron, shape (m, 4) or (m, 10).
        nodes: At rest, shape (nodes, 3) [m].
        held: Which nodes do not move.
        surface: Node of each vertex of the surface, shape (n,).
        columns: The Green's functions.

    Raises:
        BodyError: Nothing is held, too little, or everything.
    """

    def __init__(
        self,
        tets: TetMesh,
        held: npt.NDArray[np.bool_],
        settings: SolidSettings | None = None,
        name: str = "solid",
    ) -> None:
        self.settings = settings or SolidSettings()
        self._name = name
        self.tets = tets
        self.nodes, self.elements, faces, self.held = _nodes(tets, held, self.settings.order)
        _check_held(self.nodes, self.held)
        self.stiffness = stiffness(
            tets, self.elements, len(self.nodes), self.settings.young, self.settings.nu
        )
        self.surface = np.unique(faces)
        self._mesh = SurfaceMesh(self.nodes[self.surface], np.searchsorted(self.surface, faces))
        self._contact_radius = self.settings.contact_radius or fitting_radius(self._mesh)
        self.columns = self._factored()

    def _factored(self) -> GreenColumns:
        free = np.flatnonzero(~self.held)
        place = np.full(len(self.nodes), -1, dtype=np.int64)
        place[free] = np.arange(len(free))
        dof = (3 * free[:, None] + np.arange(3)).ravel()
        shown = np.zeros(len(self.nodes), dtype=np.bool_)
        shown[self.surface] = True
        factor = Factor(sp.csr_array(self.stiffness[dof][:, dof]), self.nodes[free], shown[free])
        self.factor_bytes = factor.bytes
        return GreenColumns(factor, place[self.surface], self.settings.cache)

    @property
    def name(self) -> str:
        """Name for people and for the wire."""
        return self._name

    @property
    def mesh(self) -> SurfaceMesh:
        """The resting surface."""
        return self._mesh

    @property
    def contact_radius(self) -> float:
        """Radius of the pressure under a contact [m]."""
        return self._contact_radius

    def respond(self, loads: Sequence[Load], before: Response | None = None) -> Response:
        """Superposition of the Green's functions of what is touched; `before` plays no part."""
        del before
        n = len(self._mesh.vertices)
        touched: dict[int, list[tuple[int, float]]] = {}
        for i, load in enumerate(loads):
            for vertex, weight in zip(load.vertices.tolist(), load.weights.tolist(), strict=True):
                touched.setdefault(vertex, []).append((i, weight))
        self.columns.ensure(touched)
        fields = np.zeros((len(loads), 3 * n))
        directions = np.array([load.direction for load in loads]).reshape(-1, 3)
        # Each column is read once in a tick, whoever is on it: reading them is what a tick costs.
        for vertex, shares in touched.items():
            column = self.columns.column(vertex)
            for i, weight in shares:
                fields[i] += (weight * directions[i]) @ column
        whole = fields.reshape(-1, n, 3)
        C = np.empty((len(loads), len(loads)))
        for i, load in enumerate(loads):
            C[i] = whole[:, load.vertices] @ load.direction @ load.weights
        forces = np.array([load.force for load in loads])
        displacement = (forces @ fields).reshape(n, 3) if loads else np.zeros((n, 3))
        return DenseResponse(displacement, whole, C, 0.5 * float(forces @ C @ forces))

    def vertex_compliance(self) -> Floats:
        """C_ii of a contact centred at each vertex, along its normal, shape (n,) [m/N]."""
        return survey(self._mesh, self.columns, self._contact_radius)


def fitting_radius(mesh: SurfaceMesh) -> float:
    """A fingertip's contact radius, or what the mesh resolves if that is more [m].

    Below two distances between vertices the stiffness is the mesh's and not the body's.
    """
    spacing = mesh.size * (4.0 * np.pi / len(mesh.vertices)) ** 0.5
    return float(max(min(FINGERTIP, 0.25 * mesh.size), 2.0 * spacing))


def _nodes(
    tets: TetMesh, held: npt.NDArray[np.bool_], order: int
) -> tuple[Floats, Ints, Ints, npt.NDArray[np.bool_]]:
    """Nodes, elements, surface faces and what is held, for either order."""
    if held.shape != (len(tets.vertices),):
        raise BodyError(f"held says {held.shape} of {len(tets.vertices)} vertices")
    if order == 1:
        return tets.vertices, tets.tets, boundary(tets.tets), held
    nodes, elements = quadratic(tets)
    all_held = np.concatenate([held, np.zeros(len(nodes) - len(held), dtype=np.bool_)])
    for k, (a, b) in enumerate(EDGES):
        all_held[elements[:, 4 + k]] = held[elements[:, a]] & held[elements[:, b]]
    return nodes, elements, quadratic_boundary(elements), all_held


def _check_held(nodes: Floats, held: npt.NDArray[np.bool_]) -> None:
    if not held.any():
        raise BodyError("nothing of the object is held: it would float away; hold a part of it")
    if held.all():
        raise BodyError("all of the object is held: nothing is left that could move")
    if rigid_rank(nodes[held]) < 6:
        raise BodyError(
            f"the {int(held.sum())} vertices that are held lie on a line: the object could still"
            " turn; hold more of it"
        )
