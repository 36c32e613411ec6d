"""The lowest natural frequency of a solid: below a fraction of it, a body without mass is honest.

    K u = (2 pi f)^2 M u

by inverse iteration with a few vectors at once and their Rayleigh quotients, M lumped on the nodes.
A force that changes at f' moves the body 1 / (1 - (f' / f)^2) times as far as one that stands.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import scipy.linalg
import scipy.sparse as sp

from cohaptic_server.bodies.solid.shape import SolidSettings, SolidShape
from cohaptic_server.bodies.solid.stiffness import stiffness
from cohaptic_server.cholesky.factorise import factorise
from cohaptic_server.mesh.tetrahedra import volumes
from cohaptic_server.numeric import Floats

_VECTORS = 4
_ITERATIONS = 12
_CLOSE = 1e-3  # of the frequency, from one iteration to the next
# Share of an element's mass on a corner and on the middle of an edge, in the ratio that the
# diagonal of the consistent matrix has (Hinton, Rock, Zienkiewicz 1976).
_SHARES = {4: (1.0 / 4.0, 0.0), 10: (1.0 / 36.0, 4.0 / 27.0)}


def lumped_mass(shape: SolidShape, density: float) -> Floats:
    """Mass at each node, shape (nodes,) [kg].

    Args:
        shape: The solid.
        density: Of what it is made of [kg/m^3].
    """
    corner, middle = _SHARES[shape.elements.shape[1]]
    shares = np.full(shape.elements.shape[1], middle)
    shares[:4] = corner
    mass = density * volumes(shape.tets.vertices, shape.tets.tets)[:, None] * shares
    total = np.bincount(shape.elements.ravel(), mass.ravel(), len(shape.nodes))
    return np.asarray(total, dtype=np.float64)


def lowest_frequency(
    shape: SolidShape,
    settings: SolidSettings,
    density: float,
    progress: Callable[[float], None] = lambda share: None,
) -> float:
    """The lowest natural frequency of a solid as it is held [Hz].

    Args:
        shape: The solid.
        settings: What it is made of.
        density: [kg/m^3].
        progress: Is told the share of the work that is done.
    """
    free = np.flatnonzero(~shape.fixed)
    dof = (3 * free[:, None] + np.arange(3)).ravel()
    K = stiffness(shape.tets, shape.elements, len(shape.nodes), settings.young, settings.nu)
    # The whole factor: what is inside moves too, and a served body's forgets it.
    every = np.ones(len(free), dtype=np.bool_)
    factor = factorise(sp.csr_array(K[dof][:, dof]), shape.nodes[free], every, progress)
    M = np.repeat(lumped_mass(shape, density)[free], 3)[:, None]
    X = np.random.default_rng(0).normal(size=(len(dof), _VECTORS))
    lowest, last = 0.0, np.inf
    for _ in range(_ITERATIONS):
        Y = np.asarray(factor.solve(np.arange(len(free)), M * X), dtype=np.float64)
        squares, Q = scipy.linalg.eigh(Y.T @ (M * X), Y.T @ (M * Y))
        X = Y @ Q
        lowest = math.sqrt(float(squares[0])) / (2.0 * math.pi)
        if abs(lowest - last) < _CLOSE * lowest:
            break
        last = lowest
    return lowest
