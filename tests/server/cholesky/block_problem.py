"""The stiffness of a block of several fronts, for the tests of the factor."""

from __future__ import annotations

import functools

import numpy as np
import scipy.sparse as sp

from cohaptic_server.bodies.solid.parts import stiffness_of
from cohaptic_server.bodies.solid.shape import SolidSettings, shape_of
from cohaptic_server.numeric import Floats, Mask
from cohaptic_server.testing.blocks import block


@functools.cache
def problem() -> tuple[sp.csr_array, Floats]:
    """Stiffness and positions of the free nodes."""
    mesh, settings = block((0.1, 0.1, 0.1), (7, 7, 7)), SolidSettings(order=1)
    shape = shape_of(mesh, mesh.vertices[:, 2] <= 0.0, settings)
    free = np.flatnonzero(~shape.fixed)
    dof = (3 * free[:, None] + np.arange(3)).ravel()
    return sp.csr_array(stiffness_of(shape, settings)[dof][:, dof]), shape.nodes[free]


def on_surface(points: Floats) -> Mask:
    """Nodes on the sides and the top of the block."""
    return np.asarray((np.abs(points[:, :2]).max(axis=1) > 0.049) | (points[:, 2] > 0.099))
