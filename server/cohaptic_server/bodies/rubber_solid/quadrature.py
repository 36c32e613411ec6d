"""The quadrature points of a hyperelastic tetrahedron: a lattice of thirds, and the centre.

For small strains four inner points would suffice. But a bent element inverts at its edges first, so
the barrier of the energy must be evaluated there. J, the determinant of the deformation gradient,
is a cubic in a ten-node tetrahedron with straight edges at rest: the values of J on the lattice
determine the cubic, and its Bernstein coefficients bound J between the points.
"""

from __future__ import annotations

import math

import numpy as np

from cohaptic_server.mesh.tetrahedra import EDGES
from cohaptic_server.numeric import Floats

# Weight of a corner, a third point of an edge, the middle of a face, and the centre. With totals of
# 1 / 10 - 5 e / 27, e, 9 / 10 - 2 e and 32 e / 27 for the 4, 12, 4 and 1 points the rule has degree
# 3 for every e; at e = 0.3 all weights are positive.
_WEIGHTS = (1.0 / 90.0, 1.0 / 40.0, 3.0 / 40.0, 16.0 / 45.0)


def shape_gradients(count: int) -> Floats:
    """Return the derivatives dN_a/dL_i at the quadrature points, shape (q, a, 4).

    L_i are the barycentric coordinates. The shape functions N_a are L_a (2 L_a - 1) and 4 L_p L_q
    with ten nodes, L_a with four.

    Args:
        count: Number of nodes of an element, 4 or 10.
    """
    if count == 4:
        return np.eye(4)[None]
    points = lattice()
    D = np.zeros((len(points), 10, 4))
    for a in range(4):
        D[:, a, a] = 4.0 * points[:, a] - 1.0
    for e, (p, q) in enumerate(EDGES):
        D[:, 4 + e, p] = 4.0 * points[:, q]
        D[:, 4 + e, q] = 4.0 * points[:, p]
    return D


def lattice() -> Floats:
    """Return barycentric coordinates of the lattice of thirds, and of the centre, shape (21, 4)."""
    one = np.eye(4)
    thirds = [(2.0 * one[a] + one[b]) / 3.0 for a in range(4) for b in range(4) if a != b]
    return np.concatenate([one, thirds, (1.0 - one) / 3.0, np.full((1, 4), 0.25)])


def whole_bounds() -> Floats:
    """Return the matrix from a cubic's values on the lattice to Bernstein coefficients, (20, 20).

    These coefficients bound the cubic less tightly than the coefficients of `bounds`, which are
    their weighted means.
    """
    return np.asarray(np.linalg.inv(_bernstein(lattice()[:20])), dtype=np.float64)


def bounds() -> Floats:
    """Return the matrix from a cubic's values on the lattice to tight bounds, shape (160, 20).

    The bounds are the Bernstein coefficients of the cubic in the eight parts of a tetrahedron that
    is cut at the middles of its edges. The cubic lies between the smallest and the largest one.
    """
    corners = [np.eye(4)[k] for k in range(4)]
    ab, bc, ac, ad, bd, cd = (0.5 * (corners[p] + corners[q]) for p, q in EDGES)
    a, b, c, d = corners
    parts = [(a, ab, ac, ad), (b, ab, bc, bd), (c, ac, bc, cd), (d, ad, bd, cd)]
    ring = [ab, bc, cd, ad]  # corners of the remaining octahedron round its axis ac - bd
    parts += [(ac, bd, ring[k], ring[k - 1]) for k in range(4)]
    thirds, to_coefficients = lattice()[:20], whole_bounds()
    return np.concatenate(
        [to_coefficients @ _bernstein(thirds @ np.array(part)) @ to_coefficients for part in parts]
    )


def _bernstein(points: Floats) -> Floats:
    """Return the Bernstein polynomials of degree 3 at barycentric points, shape (p, 20)."""
    powers = np.rint(3.0 * lattice()[:20]).astype(np.int64)  # (20, 4), rows sum to 3
    multinomial = 6.0 / np.array([math.prod(map(math.factorial, p)) for p in powers.tolist()])
    return np.asarray(multinomial * np.prod(points[:, None] ** powers, axis=2))


def weights(points: int) -> Floats:
    """Return the weight of each quadrature point as a share of the volume, shape (q,).

    Args:
        points: Number of quadrature points, 1 or 21.
    """
    return np.ones(1) if points == 1 else np.repeat(_WEIGHTS, (4, 12, 4, 1))
