"""Geometry, material and boundary conditions of a solid, from which its stiffness follows.

A solid has one material or several; each element has elastic moduli of its own.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from cohaptic.errors import BodyError, HeldError, SettingError
from cohaptic_server.mesh.rigid_motions import rigid_rank
from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.mesh.tetrahedra import (
    EDGES,
    TetMesh,
    boundary,
    quadratic,
    quadratic_boundary,
)
from cohaptic_server.numeric import Floats, Ints, Mask
from cohaptic_server.touchable import NU, ORDER, YOUNG

# Largest ratio of the stiffest part's modulus to the softest part's. A factor in double precision
# loses as many digits as this ratio has; beyond it, fewer than the ten digits that columns and
# presses need would be left.
MAX_CONTRAST = 1e6


@dataclass(frozen=True, eq=False)
class Moduli:
    """Young's modulus and Poisson's ratio of each tetrahedron.

    Args:
        young: Young's modulus E, shape (m,) [Pa].
        nu: Poisson's ratio, shape (m,).

    Raises:
        BodyError: The shapes do not fit, or the stiffest element is too stiff for the softest one.
    """

    young: Floats
    nu: Floats

    def __post_init__(self) -> None:
        if self.young.ndim != 1 or self.young.shape != self.nu.shape or not len(self.young):
            raise BodyError(f"moduli of {self.young.shape} and {self.nu.shape} elements")
        low, high = float(self.young.min()), float(self.young.max())
        if not high <= MAX_CONTRAST * low:
            raise BodyError(
                f"the stiffest part has {high:g} Pa and the softest one {low:g} Pa: beyond a ratio"
                f" of {MAX_CONTRAST:g} the solution has too few digits"
            )

    @classmethod
    def uniform(cls, count: int, young: float, nu: float) -> Moduli:
        """Return the moduli of `count` elements of one material."""
        return cls(np.full(count, young), np.full(count, nu))

    @property
    def is_uniform(self) -> bool:
        """Whether all elements have the same material."""
        same = self.young.min() == self.young.max() and self.nu.min() == self.nu.max()
        return bool(same)

    @property
    def lame(self) -> Floats:
        """Lame's first constant lambda, shape (m,) [Pa]."""
        return np.asarray(self.young * self.nu / ((1.0 + self.nu) * (1.0 - 2.0 * self.nu)))

    @property
    def mu(self) -> Floats:
        """Shear modulus, Lame's second constant, shape (m,) [Pa]."""
        return np.asarray(self.young / (2.0 * (1.0 + self.nu)))

    def of_elements(self, elements: Ints) -> Moduli:
        """Return the moduli of some elements (k,); an element may occur several times."""
        return Moduli(self.young[elements], self.nu[elements])


FINGERTIP = 0.008  # m; contact radius of a finger


@dataclass(frozen=True, slots=True)
class SolidSettings:
    """Material, elements and contact radius of a solid.

    Args:
        young: Young's modulus E [Pa]; soft tissue has 1e3 to 1e5, rubber 1e6. A solid of several
            materials takes `Moduli` instead.
        nu: Poisson's ratio, 0 to 0.499.
        contact_radius: Radius of the pressure under a contact [m]; 0 takes the radius of
            `fitting_radius`.
        order: 1 for linear tetrahedra, 2 for quadratic ones (docs/design/solid.md).
        cache: Memory for Green's functions [bytes].
    """

    young: float = YOUNG
    nu: float = NU
    contact_radius: float = 0.0
    order: int = ORDER
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


@runtime_checkable
class Shaped(Protocol):
    """A body that consists of the elements of a `SolidShape`."""

    @property
    def shape(self) -> SolidShape:
        """Nodes, elements and surface."""
        ...


@dataclass(frozen=True, eq=False)
class SolidShape:
    """Nodes, surface and material of a solid.

    Args:
        tets: The object at rest.
        nodes: Positions at rest, shape (nodes, 3) [m].
        elements: Nodes of each tetrahedron, shape (m, 4) or (m, 10).
        fixed: Nodes that do not move, shape (nodes,).
        surface: Node of each vertex of the surface, shape (n,).
        mesh: The resting surface.
        contact_radius: Radius of the pressure under a contact [m].
        moduli: Elastic moduli of each tetrahedron.
    """

    tets: TetMesh
    nodes: Floats
    elements: Ints
    fixed: Mask
    surface: Ints
    mesh: SurfaceMesh
    contact_radius: float
    moduli: Moduli

    @property
    def held(self) -> Mask:
        """Mask of the surface vertices that are fixed, shape (n,)."""
        return np.asarray(self.fixed[self.surface])

    @property
    def free_index(self) -> Ints:
        """Index of each surface vertex among the free nodes, -1 where it is fixed, shape (n,)."""
        index = np.full(len(self.nodes), -1, dtype=np.int64)
        free = np.flatnonzero(~self.fixed)
        index[free] = np.arange(len(free))
        return np.asarray(index[self.surface])


def shape_of(
    tets: TetMesh, fixed: Mask, settings: SolidSettings, moduli: Moduli | None = None
) -> SolidShape:
    """Build the nodes and the surface of a solid.

    Args:
        tets: The object at rest.
        fixed: Vertices that do not move, shape (n,).
        settings: Material, elements and contact radius.
        moduli: Elastic moduli of each tetrahedron; None takes the material of the settings for all
            of them.

    Raises:
        BodyError: No vertices are fixed, too few, or all of them; or the number of moduli is wrong.
    """
    if moduli is None:
        moduli = Moduli.uniform(len(tets.tets), settings.young, settings.nu)
    if len(moduli.young) != len(tets.tets):
        raise BodyError(f"moduli of {len(moduli.young)} elements for {len(tets.tets)}")
    nodes, elements, faces, all_fixed = _nodes(tets, fixed, settings.order)
    _check_fixed(nodes, all_fixed)
    surface = np.unique(faces)
    mesh = SurfaceMesh(nodes[surface], np.searchsorted(surface, faces), tets.origin)
    radius = settings.contact_radius or fitting_radius(mesh)
    return SolidShape(tets, nodes, elements, all_fixed, surface, mesh, radius, moduli)


def fitting_radius(mesh: SurfaceMesh) -> float:
    """Return a contact radius for a mesh: a fingertip's if that fits the mesh [m].

    The radius is at most a quarter of the mesh's size, but at least two vertex spacings. With a
    smaller radius the stiffness would depend on the mesh, not on the body.
    """
    return max(min(FINGERTIP, 0.25 * mesh.size), 2.0 * mesh.spacing())


def _nodes(tets: TetMesh, fixed: Mask, order: int) -> tuple[Floats, Ints, Ints, Mask]:
    """Return nodes, elements, surface faces and fixed nodes, for elements of order 1 or 2."""
    if fixed.shape != (len(tets.vertices),):
        raise BodyError(f"held says {fixed.shape} of {len(tets.vertices)} vertices")
    if order == 1:
        return tets.vertices, tets.tets, boundary(tets.tets), fixed
    nodes, elements = quadratic(tets)
    all_fixed = np.concatenate([fixed, np.zeros(len(nodes) - len(fixed), dtype=np.bool_)])
    for k, (a, b) in enumerate(EDGES):
        all_fixed[elements[:, 4 + k]] = fixed[elements[:, a]] & fixed[elements[:, b]]
    return nodes, elements, quadratic_boundary(elements), all_fixed


def _check_fixed(nodes: Floats, fixed: Mask) -> None:
    if not fixed.any():
        raise HeldError("nothing of the object is held: it would float away; hold a part of it")
    if fixed.all():
        raise HeldError("all of the object is held: nothing is left that could move")
    if rigid_rank(nodes[fixed]) < 6:
        raise HeldError(
            f"the {int(fixed.sum())} vertices that are held lie on a line: the object could still"
            " turn; hold more of it"
        )
