"""Rigid motions of points, which store no elastic energy."""

from __future__ import annotations

import numpy as np

from cohaptic_server.numeric import Floats


def rigid_motions(x: Floats) -> Floats:
    """Return the displacement of points by each of the six rigid motions.

    Args:
        x: Positions of the points, shape (n, 3) [m].

    Returns:
        One motion per column, shape (3 n, 6): translations by 1 m along x, y and z, then rotations
        by 1 rad about these axes through the origin, to first order.
    """
    motions = np.zeros((len(x), 3, 6))
    motions[:, :, :3] = np.eye(3)
    for axis in range(3):
        motions[:, :, 3 + axis] = np.cross(np.eye(3)[axis], x)
    return motions.reshape(-1, 6)


def rigid_rank(x: Floats) -> int:
    """Return how many of the six rigid motions a body loses if some of its points are fixed.

    Args:
        x: Positions of the fixed points, shape (n, 3) [m].
    """
    centred = x - x.mean(axis=0)
    size = float(np.abs(centred).max()) or 1.0
    return int(np.linalg.matrix_rank(rigid_motions(centred / size), tol=1e-6))
