"""Adds up the vectors or blocks of triangles into a vector or sparse matrix over all vertices."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from cohaptic_server.numeric import Floats, Ints


def scatter_vector(per_face: Floats, faces: Ints, n: int) -> Floats:
    """Sum vectors of shape (m, 3 corners, 3) over the faces into one of shape (3 n,)."""
    total = np.zeros((n, 3))
    np.add.at(total, faces.ravel(), per_face.reshape(-1, 3))
    return total.ravel()


def scatter_matrix(blocks: Floats, faces: Ints, n: int) -> sp.csr_array:
    """Sum blocks (m, 3 corners, 3, 3 corners, 3) over the faces into a sparse matrix."""
    dof = (3 * faces[:, :, None] + np.arange(3)).reshape(len(faces), 9)
    rows, columns = np.repeat(dof, 9, axis=1).ravel(), np.tile(dof, (1, 9)).ravel()
    matrix = sp.coo_array((blocks.reshape(-1), (rows, columns)), shape=(3 * n, 3 * n))
    return sp.csr_array(matrix)
