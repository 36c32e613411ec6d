"""Tables of a tetrahedron's shape functions, for the loops over its corners and points.

The gradients of ten-node shape functions are linear, so a deformation gradient is interpolated from
the corners: F = sum_c L_c F_c. Four-node elements have one point and one such corner.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from cohaptic_server.bodies.rubber_solid.quadrature import lattice, shape_gradients
from cohaptic_server.numeric import Floats, Ints


@dataclass(frozen=True, eq=False)
class ShapeTables:
    """Tables of the elements' shape functions; a nodes, c corners, q quadrature points.

    Args:
        interpolation: Shape functions of the corners at the points, shape (c, q).
        products: Their products in pairs, shape (r, q).
        nodes: Node that each y_s is made of beside s itself, shape (c, 4).
        factors: Factor of that node, and of node s, shape (c, 4, 2).
        terms: Barycentric coordinates in each shape function, shape (a, 2).
        shapes: Derivatives by these at the points, shape (a, 2, q).
        turning: From the vectors of `element_loops.turns`, shape (6 r), to those of the pairs of
            nodes, shape (6 r, a (a + 1) / 2).
    """

    interpolation: Floats
    products: Floats
    nodes: Ints
    factors: Floats
    terms: Ints
    shapes: Floats
    turning: Floats

    @classmethod
    def of(cls, count: int) -> ShapeTables:
        """The tables of elements of `count` nodes, 4 or 10."""
        D = shape_gradients(count)  # (q, a, 4)
        L = np.ones((1, 1)) if count == 4 else lattice()
        corners = L.shape[1]
        at_corners = D[:corners]  # the corners are the first points
        pairs = list(itertools.combinations_with_replacement(range(corners), 2))
        nodes, factors = _pulls(at_corners)
        terms = _terms(D)
        shapes = np.stack([D[:, a, s] for a, s in enumerate(terms)], axis=1)  # (q, a, 2)
        shapes[:, terms[:, 0] == terms[:, 1], 1] = 0.0
        return cls(
            np.ascontiguousarray(L.T),
            np.stack([L[:, c] * L[:, d] for c, d in pairs]),
            nodes,
            factors,
            terms,
            np.ascontiguousarray(shapes.transpose(1, 2, 0)),
            _turning(at_corners, pairs),
        )


def _pulls(at_corners: Floats) -> tuple[Ints, Floats]:
    """Nodes and factors of y_s at the corners, from the derivatives there, shape (c, a, 4)."""
    corners = len(at_corners)
    nodes, factors = np.zeros((corners, 4), dtype=np.int64), np.zeros((corners, 4, 2))
    for c, s in itertools.product(range(corners), range(4)):
        others = [a for a in np.flatnonzero(at_corners[c, :, s]).tolist() if a != s]
        nodes[c, s] = others[0] if others else s
        factors[c, s, 0] = at_corners[c, others[0], s] if others else 0.0
        factors[c, s, 1] = at_corners[c, s, s]
    return nodes, factors


def _terms(D: Floats) -> Ints:
    """The one or two barycentric coordinates in each shape function, shape (a, 2)."""
    found = [np.flatnonzero(np.abs(D[:, a]).max(axis=0)) for a in range(D.shape[1])]
    return np.array([[s[0], s[-1]] for s in found], dtype=np.int64)


def _turning(at_corners: Floats, pairs: list[tuple[int, int]]) -> Floats:
    """The sums  dN_a/dL_s dN_b/dL_t - dN_a/dL_t dN_b/dL_s  of each pair of corners."""
    count = at_corners.shape[1]
    sides = list(itertools.combinations(range(4), 2))
    table = np.zeros((len(pairs), len(sides), count * (count + 1) // 2))
    nodes = [(a, b) for a in range(count) for b in range(a + 1)]
    for (r, (c, d)), (e, (s, t)), (k, (a, b)) in itertools.product(
        enumerate(pairs), enumerate(sides), enumerate(nodes)
    ):
        for one, two in {(c, d), (d, c)}:
            table[r, e, k] += (
                at_corners[one, a, s] * at_corners[two, b, t]
                - at_corners[one, a, t] * at_corners[two, b, s]
            )
    return table.reshape(-1, len(nodes))
