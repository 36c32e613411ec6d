"""The lowest natural modes of a solid, for its swing and for the validity of a static model.

    K x = w^2 M x

with the mode x, its angular frequency w, the stiffness K over the free nodes and the lumped mass M.
The Lanczos method in shift-invert mode (ARPACK) finds the smallest w; each step solves with the
Cholesky factor of K. Under a force that oscillates with the angular frequency w', a mode moves
1 / (1 - (w' / w)^2) times as far as under a constant force.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg

from cohaptic_server.bodies.solid.parts import plan_of_solid, stiffness_of
from cohaptic_server.bodies.solid.shape import SolidShape
from cohaptic_server.cholesky.factorise import factorise
from cohaptic_server.cholesky.plan import Plan
from cohaptic_server.mesh.tetrahedra import volumes
from cohaptic_server.numeric import Floats

_TOLERANCE = 1e-6  # relative tolerance of the squared frequency
# Share of an element's mass at a corner and at a midside node, by the number of nodes. The shares
# are in the ratio of the diagonal of the consistent mass matrix (Hinton, Rock, Zienkiewicz 1976).
_FRACTIONS = {4: (1.0 / 4.0, 0.0), 10: (1.0 / 36.0, 4.0 / 27.0)}


@dataclass(frozen=True, eq=False)
class Vibration:
    """Natural modes of a solid with its fixed nodes at rest, the slowest first.

    Args:
        frequency: Natural angular frequencies, shape (k,) [rad/s].
        shapes: Displacement of every node by each mode, normalised with the mass M so that
            shapes' M shapes = 1, shape (k, nodes, 3) [1 / sqrt(kg)].
    """

    frequency: Floats
    shapes: Floats


def lumped_mass(shape: SolidShape, density: float | Floats) -> Floats:
    """Return the mass at each node, shape (nodes,) [kg].

    Args:
        density: Mass density of all tetrahedra, or of each one, shape (m,) [kg/m^3].
    """
    corner, midside = _FRACTIONS[shape.elements.shape[1]]
    fractions = np.full(shape.elements.shape[1], midside)
    fractions[:4] = corner
    mass = (density * volumes(shape.tets.vertices, shape.tets.tets))[:, None] * fractions
    total = np.bincount(shape.elements.ravel(), mass.ravel(), len(shape.nodes))
    return np.asarray(total, dtype=np.float64)


def natural_modes(
    shape: SolidShape,
    density: float | Floats,
    count: int,
    progress: Callable[[float], None] = lambda fraction: None,
    accept: Callable[[Plan], None] = lambda plan: None,
) -> Vibration:
    """Compute the lowest natural modes of a solid.

    Args:
        density: As for `lumped_mass`.
        count: Number of modes, 1 or more.
        progress: Called with the completed share of the work.
        accept: Called with the plan before factoring begins; may raise an error to prevent it.

    Raises:
        BodyError: The stiffness is not positive definite.
    """
    free = np.flatnonzero(~shape.fixed)
    dof = (3 * free[:, None] + np.arange(3)).ravel()
    K = sp.csr_array(stiffness_of(shape)[dof][:, dof])
    # The factor of a served solid leaves out interior nodes, but these carry mass, too.
    every_node = np.ones(len(shape.nodes), dtype=np.bool_)
    plan = plan_of_solid(shape, every_node)
    accept(plan)
    factor = factorise(K, shape.nodes[free], every_node[free], progress, plan)
    nodes = np.arange(len(free))

    def solve(force: Floats) -> Floats:
        displacement = factor.solve(nodes, np.asarray(force).reshape(-1, 1))
        return np.asarray(displacement, dtype=np.float64).reshape(-1)

    count = min(count, len(dof) - 1)
    squares, vectors = scipy.sparse.linalg.eigsh(
        K,
        k=count,
        M=sp.diags_array(np.repeat(lumped_mass(shape, density)[free], 3), format="csr"),
        sigma=0.0,
        OPinv=scipy.sparse.linalg.LinearOperator(K.shape, matvec=solve, dtype=np.float64),
        v0=np.random.default_rng(0).normal(size=len(dof)),
        # Enough for the lowest modes; with the default of 20 a single mode takes twice as long.
        ncv=min(2 * count + 6, len(dof)),
        tol=_TOLERANCE,
    )
    order = np.argsort(squares)
    shapes = np.zeros((count, len(shape.nodes), 3))
    shapes[:, free] = vectors[:, order].T.reshape(count, len(free), 3)
    return Vibration(np.sqrt(squares[order]), shapes)


def lowest_frequency(
    shape: SolidShape,
    density: float | Floats,
    progress: Callable[[float], None] = lambda fraction: None,
) -> float:
    """Return the lowest natural frequency of a solid with its fixed nodes at rest [Hz].

    Args:
        density: As for `lumped_mass`.
        progress: Called with the completed share of the work.

    Raises:
        BodyError: The stiffness is not positive definite.
    """
    slowest: float = natural_modes(shape, density, 1, progress).frequency[0].item()
    return slowest / (2.0 * math.pi)
