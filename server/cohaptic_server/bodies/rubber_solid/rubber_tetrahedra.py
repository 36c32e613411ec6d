"""Hyperelastic tetrahedra at any deformation: energy, internal forces and tangent.

Everything that depends on the mesh alone is computed once: gradients of the shape functions at the
quadrature points, and the entry of the factor to which each product of them goes. A tick then works
on all points at once, with one small product for each element and one sparse product.

No element is inverted: `quadrature.py` bounds J throughout each, and no step is taken that brings
the bound below `_MIN_J`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from cohaptic_server.bodies.hyperelastic import IndefiniteTangentError
from cohaptic_server.bodies.rubber_solid.neo_hookean import NeoHookean, SolidStrain, solid_strain
from cohaptic_server.bodies.rubber_solid.quadrature import bounds, shape_gradients, weights
from cohaptic_server.bodies.solid.shape import SolidShape
from cohaptic_server.cholesky.refactor import Indefinite, Refactored
from cohaptic_server.cholesky.symbolic import Analysis, analyse, dofs
from cohaptic_server.mesh.tetrahedra import gradients, volumes
from cohaptic_server.numeric import Floats, Ints

# Least share of J that a step leaves at every point: the fraction-to-the-boundary rule of interior
# point methods.
_MIN_SHARE = 0.1
_MIN_J = 0.01  # least J anywhere in an element


@dataclass(frozen=True, eq=False)
class SolidState:
    """A deformed solid, not necessarily in equilibrium.

    Args:
        x: Positions of the nodes, shape (n, 3) [m].
        strain: Strain at the quadrature points.
        energy: Stored energy [J].
        internal_force: dE/dx, shape (n, 3) [N].
    """

    x: Floats
    strain: SolidStrain
    energy: float
    internal_force: Floats


@dataclass(frozen=True, eq=False)
class SolidTangent:
    """A factored tangent: a `TangentSolver`."""

    factor: Refactored

    def displacements(self, b: Floats) -> Floats:
        """Disindexments of the unknowns, shape (c, size) [m], under forces `b` (c, size) [N]."""
        return np.ascontiguousarray(self.factor.solve(b.T).T)


class RubberTetrahedra:
    """A solid of one material, fixed in part: a `Hyperelastic` body.

    Args:
        shape: Nodes and elements at rest, and the fixed nodes.
        material: The hyperelastic material.

    Attributes:
        material: As given.
        dof: Unknowns in the order of the factor, as indices into (3 n,), shape (size,).
    """

    # Shares of the negative part of the moduli that are removed.
    stiffenings = (1.0,)

    def __init__(self, shape: SolidShape, material: NeoHookean) -> None:
        tets, nodes, elements = shape.tets, shape.nodes, shape.elements
        self.material, self._elements, self._bounds = material, elements, bounds()
        m, count = elements.shape
        D = shape_gradients(count)  # (q, a, 4)
        points = len(D)
        g = np.einsum("qai,mip->maqp", D, gradients(tets.vertices, tets.tets))
        self._weights = np.repeat(volumes(tets.vertices, tets.tets), points) * np.tile(
            weights(points), m
        )
        self._by_element = np.ascontiguousarray(g.reshape(m, count, 3 * points))
        self._by_point = np.ascontiguousarray(g.transpose(1, 3, 0, 2)).reshape(count, 3, -1)
        corners = (np.ones(elements.size), (elements.ravel(), np.arange(elements.size)))
        self._sum = sp.csr_array(corners, shape=(len(nodes), elements.size))
        free = np.flatnonzero(~shape.fixed)
        self.dof = dofs(free)
        self._analysis, self._same, self._crossed = _pattern(elements, nodes, free)
        self._steady = material.mu * self._between(self._by_point, self._weights)

    def at(self, x: Floats, least: Floats | float = 0.0) -> SolidState | None:
        """The solid with its nodes at `x`.

        Args:
            x: Shape (n, 3) [m].
            least: Lower bound of J, one for all points or one for each, shape (q,).

        Returns:
            None where J is not above `least` at a point, or not above `_MIN_J` in an element.
        """
        m, count = self._elements.shape
        F = x[self._elements].transpose(0, 2, 1) @ self._by_element  # (m, 3, 3 q)
        strain = solid_strain(
            np.ascontiguousarray(F.reshape(m, 3, -1, 3).transpose(1, 3, 0, 2)).reshape(3, 3, -1),
            least,
        )
        if strain is None or not (self._lower_bounds(strain.J) > _MIN_J).all():
            return None
        energy = float(self._weights @ self.material.energy_density(strain))
        P = (self.material.stress(strain) * self._weights).reshape(3, 3, m, -1)
        internal = self._by_element @ P.transpose(2, 3, 1, 0).reshape(m, -1, 3)  # (m, a, 3)
        return SolidState(x, strain, energy, np.asarray(self._sum @ internal.reshape(m * count, 3)))

    def _lower_bounds(self, J: Floats) -> Floats:
        """Lower bounds of J that together hold throughout each element, shape (m, ...)."""
        by_element = J.reshape(len(self._elements), -1)
        if by_element.shape[1] == 1:
            return by_element
        return np.asarray(by_element[:, :20] @ self._bounds.T)

    def displaced(self, state: SolidState, step: Floats, external: Floats) -> SolidState | None:
        """The state after a step; None if J falls below `_MIN_SHARE` of its value somewhere."""
        del external
        return self.at(state.x + step, _MIN_SHARE * np.minimum(state.strain.J, 1.0))

    def residual(self, state: SolidState, external: Floats) -> Floats:
        """External forces less internal forces, shape (n, 3) [N]."""
        return np.asarray(external - state.internal_force)

    def factor_tangent(self, state: SolidState, stiffening: float) -> SolidTangent:
        """Factor the tangent, with a share `stiffening` of its negative moduli removed."""
        strain, m = state.strain, len(self._elements)
        h = np.einsum("apq,pjq->ajq", self._by_point, strain.inverse)
        transpose = self._weights * self.material.transpose_modulus(strain)
        entries = self._steady
        if stiffening:
            entries = entries + self._between(h, 0.5 * stiffening * np.abs(transpose))
            transpose = (1.0 - 0.5 * stiffening) * transpose
        volumetric = self._weights * self.material.volumetric_modulus(strain)
        moduli = np.stack([volumetric, transpose])
        # (m, 2, 3 a, q) by (m, 1, q, 3 a): both products of each element.
        rows = h.reshape(-1, m, h.shape[2] // m).transpose(1, 0, 2)
        left = rows[:, None] * moduli.reshape(2, m, 1, -1).swapaxes(0, 1)
        products = left.reshape(m, -1, rows.shape[2]) @ rows.swapaxes(1, 2)
        entries = entries + self._crossed @ products.ravel()
        try:
            return SolidTangent(Refactored(self._analysis, entries))
        except Indefinite as error:
            raise IndefiniteTangentError("the tangent is indefinite") from error

    def _between(self, h: Floats, moduli: Floats) -> Floats:
        """Entries of sum_q moduli (h_a . h_b) d_ij.

        Args:
            h: Gradients of the shape functions, shape (a, 3, m q).
            moduli: Moduli times quadrature weights, shape (m q,) [N m].

        Returns:
            In the order of the factor's entries, shape (e,) [N/m].
        """
        m, count = self._elements.shape
        rows = h.reshape(count, 3, m, -1).transpose(2, 0, 1, 3)  # (m, a, 3, q)
        left = rows * moduli.reshape(m, 1, 1, -1)
        products = left.reshape(m, count, -1) @ rows.reshape(m, count, -1).swapaxes(1, 2)
        return np.asarray(self._same @ products.ravel())


def _pattern(
    elements: Ints, nodes: Floats, free: Ints
) -> tuple[Analysis, sp.csr_array, sp.csr_array]:
    """The pattern of the factor, and maps to its entries from the products of each element.

    Args:
        elements: Nodes of each element, shape (m, a).
        nodes: Positions of the nodes at rest, shape (n, 3) [m].
        free: Nodes that can move.

    Returns:
        The analysis of the pattern; the map from products (m, a, a), which go to entries of equal
        axes; the map from products (m, 2, 3 a, 3 a), the first of them as they are and the second
        with their axes exchanged.
    """
    m, count = elements.shape
    index = np.full(len(nodes), -1, dtype=np.int64)
    index[free] = np.arange(len(free))
    size, width = 3 * len(free), 3 * count
    first = np.where(index[elements] < 0, -size, 3 * index[elements])
    unknown = (first[:, :, None] + np.arange(3)).reshape(m, width)
    row, column = np.repeat(unknown, width, axis=1).ravel(), np.tile(unknown, (1, width)).ravel()
    both_free = (row >= 0) & (column >= 0)
    ones = np.ones(int(both_free.sum()))
    matrix = sp.csr_array((ones, (row[both_free], column[both_free])), shape=(size, size))
    analysis = analyse(matrix, nodes[free])
    rows = np.repeat(np.arange(size), np.diff(matrix.indptr))[analysis.entries]
    keys = rows * size + matrix.indices[analysis.entries]
    order = np.argsort(keys)
    key = row * size + column
    at = np.minimum(np.searchsorted(keys[order], key), len(keys) - 1)
    kept = np.flatnonzero(both_free & (keys[order][at] == key))
    entry = order[at[kept]]
    element, inside = kept // width**2, kept % width**2
    (a, i), (b, j) = divmod(inside // width, 3), divmod(inside % width, 3)
    straight = 2 * element * width**2 + inside
    crossed = (2 * element + 1) * width**2 + (3 * a + j) * width + 3 * b + i
    same_axis = i == j
    between = element[same_axis] * count**2 + a[same_axis] * count + b[same_axis]
    return (
        analysis,
        _sums(entry[same_axis], between, (len(keys), m * count**2)),
        _sums(
            np.concatenate([entry, entry]),
            np.concatenate([straight, crossed]),
            (len(keys), 2 * m * width**2),
        ),
    )


def _sums(target: Ints, source: Ints, shape: tuple[int, int]) -> sp.csr_array:
    """The matrix that adds element `source` of a vector to entry `target`, for each pair."""
    return sp.csr_array((np.ones(len(target)), (target, source)), shape=shape)
