"""The expensive parts of a solid, computed once: its factor and its far field."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import scipy.sparse as sp

from cohaptic_server.bodies.solid.far_field import FarField
from cohaptic_server.bodies.solid.far_field_build import build_far_field
from cohaptic_server.bodies.solid.moduli import Moduli
from cohaptic_server.bodies.solid.shape import SolidSettings, SolidShape, shape_of
from cohaptic_server.bodies.solid.stiffness import stiffness
from cohaptic_server.cholesky.factor import Factor, FactorReader
from cohaptic_server.cholesky.factorise import factorise
from cohaptic_server.cholesky.plan import Plan, plan_of
from cohaptic_server.cholesky.symbolic import graph_of_elements
from cohaptic_server.mesh.tetrahedra import TetMesh
from cohaptic_server.numeric import Mask
from cohaptic_server.process_memory import give_back
from cohaptic_server.progress import Progress


@dataclass(frozen=True, eq=False)
class SolidParts:
    """The parts from which a solid is made in a moment.

    Args:
        shape: Nodes and surface.
        factor: Factor of the stiffness over the free nodes, or where it can be read.
        far_field: Compliance between samples of the surface.
    """

    shape: SolidShape
    factor: Factor | FactorReader
    far_field: FarField


class KeptFactor(Protocol):
    """Where a factor in double precision outlives an interruption."""

    def load(self) -> Factor | None:
        """The factor; None where there is none."""
        ...

    def save(self, factor: Factor) -> None:
        """Keep it."""
        ...


def plan_of_solid(shape: SolidShape, retained: Mask | None = None) -> Plan:
    """What factoring a solid will take, from its elements alone.

    Args:
        shape: Nodes and surface.
        retained: Nodes that can be loaded and read, shape (nodes,); None takes the surface's.
    """
    if retained is None:
        retained = _on_surface(shape)
    free = np.flatnonzero(~shape.fixed)
    index = np.full(len(shape.nodes), -1, dtype=np.int64)
    index[free] = np.arange(len(free))
    graph = graph_of_elements(index[shape.elements], len(free))
    return plan_of(graph, shape.nodes[free], retained[free])


def factor_of(
    shape: SolidShape,
    progress: Callable[[float], None] = lambda share: None,
    plan: Plan | None = None,
) -> Factor:
    """The factor of a solid's stiffness over the free nodes.

    Args:
        shape: Nodes, surface and material.
        progress: Receives the completed share.
        plan: That of `plan_of_solid`, if it is known already.
    """
    free = np.flatnonzero(~shape.fixed)
    dof = (3 * free[:, None] + np.arange(3)).ravel()
    matrix = sp.csr_array(stiffness_of(shape)[dof][:, dof])
    points, retained = shape.nodes[free], _on_surface(shape)[free]
    plan = plan or plan_of_solid(shape)
    give_back()  # the estimate of memory counts what is in use
    return factorise(matrix, points, retained, progress, plan)


def _on_surface(shape: SolidShape) -> Mask:
    on_surface = np.zeros(len(shape.nodes), dtype=np.bool_)
    on_surface[shape.surface] = True
    return on_surface


def stiffness_of(shape: SolidShape) -> sp.csr_array:
    """Stiffness of all nodes, none of them fixed, shape (3 nodes, 3 nodes) [N/m]."""
    return stiffness(shape.tets, shape.elements, len(shape.nodes), shape.moduli)


def make_parts(
    tets: TetMesh,
    fixed: Mask,
    settings: SolidSettings,
    progress: Progress = lambda phase, share: None,
    accept: Callable[[Plan], None] = lambda plan: None,
    factored: KeptFactor | None = None,
    moduli: Moduli | None = None,
) -> SolidParts:
    """Factor the stiffness and build the far field.

    Args:
        tets: The object at rest.
        fixed: Vertices that do not move, shape (n,).
        settings: Material, elements and contact radius.
        progress: Receives the phase and its completed share.
        accept: Called with what factoring takes, before it begins; may raise.
        factored: Has the factor of an interrupted preparation, or is given it.
        moduli: As for `shape_of`.

    Raises:
        BodyError: Nothing is fixed, too little, or everything.
    """
    progress("factoring", 0.0)
    shape = shape_of(tets, fixed, settings, moduli)
    factor = None if factored is None else factored.load()
    if factor is None:
        plan = plan_of_solid(shape)
        accept(plan)
        factor = factor_of(shape, lambda share: progress("factoring", share), plan)
        if factored is not None:
            factored.save(factor)
    far_field = build_far_field(
        shape.mesh,
        shape.contact_radius,
        factor,
        shape.free_index,
        lambda share: progress("pressing", share),
    )
    return SolidParts(shape, factor, far_field)
