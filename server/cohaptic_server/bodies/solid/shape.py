"""What a solid is before anything is solved: material, nodes, surface, what is held."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cohaptic.errors import BodyError, SettingError
from cohaptic_server.mesh.rigid_motions import rigid_rank
from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.mesh.tetrahedra import (
    EDGES,
    TetMesh,
    boundary,
    quadratic,
    quadratic_boundary,
)
from cohaptic_server.numeric import Floats, Ints

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
    cache: int = 2**28

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


@dataclass(frozen=True, eq=False)
class SolidShape:
    """Nodes and surface of a solid.

    Args:
        tets: The object at rest.
        nodes: Shape (nodes, 3) [m].
        elements: Nodes of each tetrahedron, shape (m, 4) or (m, 10).
        held: Which nodes do not move.
        surface: Node of each vertex of the surface, shape (n,).
        mesh: The resting surface.
        contact_radius: Of the pressure under a contact [m].
    """

    tets: TetMesh
    nodes: Floats
    elements: Ints
    held: npt.NDArray[np.bool_]
    surface: Ints
    mesh: SurfaceMesh
    contact_radius: float

    @property
    def place(self) -> Ints:
        """Place of each surface vertex among the nodes that are free, -1 where it is held."""
        place = np.full(len(self.nodes), -1, dtype=np.int64)
        free = np.flatnonzero(~self.held)
        place[free] = np.arange(len(free))
        return np.asarray(place[self.surface])


def shape_of(tets: TetMesh, held: npt.NDArray[np.bool_], settings: SolidSettings) -> SolidShape:
    """Nodes and surface of a solid.

    Args:
        tets: The object at rest.
        held: Which of its vertices do not move, shape (n,) of bool.
        settings: What it is made of.

    Raises:
        BodyError: Nothing is held, too little, or everything.
    """
    nodes, elements, faces, all_held = _nodes(tets, held, settings.order)
    _check_held(nodes, all_held)
    surface = np.unique(faces)
    mesh = SurfaceMesh(nodes[surface], np.searchsorted(surface, faces))
    radius = settings.contact_radius or fitting_radius(mesh)
    return SolidShape(tets, nodes, elements, all_held, surface, mesh, radius)


def fitting_radius(mesh: SurfaceMesh) -> float:
    """A fingertip's contact radius, or what the mesh resolves if that is more [m].

    Below two distances between vertices the stiffness is the mesh's and not the body's.
    """
    return max(min(FINGERTIP, 0.25 * mesh.size), 2.0 * mesh.spacing())


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
