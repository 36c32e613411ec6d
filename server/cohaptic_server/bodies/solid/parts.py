"""The heavy part of a solid, done once: its factor and its coarse twin."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy.sparse as sp

from cohaptic_server.bodies.solid.far_field import CoarseTwin, make_twin
from cohaptic_server.bodies.solid.green_columns import GreenColumns
from cohaptic_server.bodies.solid.shape import SolidSettings, SolidShape, shape_of
from cohaptic_server.bodies.solid.stiffness import stiffness
from cohaptic_server.cholesky.factor import Factor
from cohaptic_server.mesh.tetrahedra import TetMesh
from cohaptic_server.progress import Progress


@dataclass(frozen=True, eq=False)
class SolidParts:
    """What a solid is made from in a moment.

    Args:
        shape: Nodes and surface.
        factor: Of the stiffness over the nodes that are free.
        twin: The solid as seen from afar.
    """

    shape: SolidShape
    factor: Factor
    twin: CoarseTwin


def make_parts(
    tets: TetMesh,
    held: npt.NDArray[np.bool_],
    settings: SolidSettings,
    progress: Progress = lambda phase, share: None,
) -> SolidParts:
    """Factor the stiffness, press on every place of the twin.

    Raises:
        BodyError: Nothing is held, too little, or everything.
    """
    progress("factoring", 0.0)
    shape = shape_of(tets, held, settings)
    factor = factor_of(shape, settings, lambda share: progress("factoring", share))
    columns = GreenColumns(factor, shape.place, 1)
    twin = make_twin(
        shape.mesh,
        shape.contact_radius,
        columns.respond,
        shape.place < 0,
        lambda share: progress("pressing", share),
    )
    return SolidParts(shape, factor, twin)


def factor_of(
    shape: SolidShape,
    settings: SolidSettings,
    progress: Callable[[float], None] = lambda share: None,
) -> Factor:
    """The factor of a solid's stiffness over the nodes that are free."""
    K = stiffness_of(shape, settings)
    free = np.flatnonzero(~shape.held)
    dof = (3 * free[:, None] + np.arange(3)).ravel()
    shown = np.zeros(len(shape.nodes), dtype=np.bool_)
    shown[shape.surface] = True
    return Factor(sp.csr_array(K[dof][:, dof]), shape.nodes[free], shown[free], progress)


def stiffness_of(shape: SolidShape, settings: SolidSettings) -> sp.csr_array:
    """Of all nodes, nothing held, shape (3 nodes, 3 nodes) [N/m]."""
    n = len(shape.nodes)
    return stiffness(shape.tets, shape.elements, n, settings.young, settings.nu)
