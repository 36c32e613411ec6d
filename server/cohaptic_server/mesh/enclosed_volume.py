"""Volume inside a closed triangle surface, with its gradient and Hessian, as sums over triangles.

The volume is V = sum a . (b x c) / 6 over triangles with corners a, b, c. The gradient times a
pressure is the force of the water on the vertices; the Hessian times the pressure is the stiffness
of a pressure that follows the surface. A translation of a closed surface changes neither of them,
so moving a free balloon takes no work.

`scatter_vector` and `scatter_matrix` add the contributions of all triangles to a vector or a sparse
matrix over all vertices.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from cohaptic_server.numeric import Floats, Ints


def scatter_vector(per_face: Floats, faces: Ints, n: int) -> Floats:
    """Add vectors at the corners of all faces to one vector over all vertices, shape (3 n,).

    Args:
        per_face: Vector at each corner of each face, shape (m, 3 corners, 3).
        faces: Vertices of each face, shape (m, 3).
        n: Number of vertices.
    """
    total = np.zeros((n, 3))
    np.add.at(total, faces.ravel(), per_face.reshape(-1, 3))
    return total.ravel()


def scatter_matrix(blocks: Floats, faces: Ints, n: int) -> sp.csr_array:
    """Add the blocks of all faces to one sparse matrix over all vertices, shape (3 n, 3 n).

    Args:
        blocks: Block of each face, shape (m, 3 corners, 3, 3 corners, 3).
        faces: Vertices of each face, shape (m, 3).
        n: Number of vertices.
    """
    dof = (3 * faces[:, :, None] + np.arange(3)).reshape(len(faces), 9)
    rows, columns = np.repeat(dof, 9, axis=1).ravel(), np.tile(dof, (1, 9)).ravel()
    matrix = sp.coo_array((blocks.reshape(-1), (rows, columns)), shape=(3 * n, 3 * n))
    return sp.csr_array(matrix)


def volume(x: Floats, faces: Ints) -> float:
    """Return the volume V that a closed surface encloses [m^3].

    Args:
        x: Positions of the vertices, shape (n, 3) [m].
        faces: Vertices of each face, counter-clockwise from outside, shape (m, 3).
    """
    a, b, c = x[faces[:, 0]], x[faces[:, 1]], x[faces[:, 2]]
    return float(np.einsum("mi,mi->", a, np.cross(b, c))) / 6.0


def volume_gradient(x: Floats, faces: Ints) -> Floats:
    """Return the gradient dV/dx, shape (3 n,) [m^2]; arguments as for `volume`."""
    a, b, c = x[faces[:, 0]], x[faces[:, 1]], x[faces[:, 2]]
    corners = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=1) / 6.0
    return scatter_vector(corners, faces, len(x))


def volume_hessian(x: Floats, faces: Ints) -> sp.csr_array:
    """Return the symmetric Hessian d2V/dx2, shape (3 n, 3 n) [m]; arguments as for `volume`."""
    corners = x[faces]  # (m, 3, 3)
    blocks = np.zeros((len(faces), 3, 3, 3, 3))
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        # d(x_i x x_j)/dx_i = -[x_j]x: the gradient at corner k moves with the other two.
        blocks[:, k, :, i, :] = -_skew(corners[:, j]) / 6.0
        blocks[:, k, :, j, :] = _skew(corners[:, i]) / 6.0
    return scatter_matrix(blocks, faces, len(x))


def _skew(v: Floats) -> Floats:
    """Return the matrix [v]x of each vector v, with [v]x w = v x w for all w, shape (m, 3, 3)."""
    out = np.zeros((len(v), 3, 3))
    out[:, 0, 1], out[:, 0, 2] = -v[:, 2], v[:, 1]
    out[:, 1, 0], out[:, 1, 2] = v[:, 2], -v[:, 0]
    out[:, 2, 0], out[:, 2, 1] = -v[:, 1], v[:, 0]
    return out
