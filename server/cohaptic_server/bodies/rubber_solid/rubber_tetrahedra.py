"""Hyperelastic tetrahedra at any deformation, as `settling.py` sees them: energy, forces, tangent.

What the mesh fixes is found once: gradients of the nodes' functions at the quadrature points, and
which entry of the factor each product of them goes to. A tick then does arithmetic on all points at
a time, one small product for each element, and one sparse product.

No element turns inside out: `lattice.py` bounds J all over each, and no step is taken that brings
the bound below `_FLOOR`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from cohaptic_server.bodies.newton import Unstable
from cohaptic_server.bodies.rubber_solid.neo_hookean import NeoHookean, Strained, strained
from cohaptic_server.bodies.rubber_solid.quadrature import bounds, shape_gradients, weights
from cohaptic_server.bodies.solid.shape import SolidShape
from cohaptic_server.cholesky.refactor import Indefinite, Refactored
from cohaptic_server.cholesky.symbolic import Analysis, analyse, dofs
from cohaptic_server.mesh.tetrahedra import gradients, volumes
from cohaptic_server.numeric import Floats, Ints

# Of J that a step leaves at every point, as interior point methods keep off their barrier.
_LEFT = 0.1
_FLOOR = 0.01  # of J, anywhere


@dataclass(frozen=True, eq=False)
class SolidState:
    """A deformed solid, not always in equilibrium.

    Args:
        x: Nodes, shape (n, 3) [m].
        strain: At the quadrature points.
        energy: Stored [J].
        force: That holds it so, shape (n, 3) [N].
    """

    x: Floats
    strain: Strained
    energy: float
    force: Floats


@dataclass(frozen=True, eq=False)
class SolidTangent:
    """A factored tangent: a `Solver`."""

    factor: Refactored

    def displacements(self, b: Floats) -> Floats:
        """Of the unknowns, shape (c, size) [m], under forces `b` (c, size) [N]."""
        return np.ascontiguousarray(self.factor.solve(b.T).T)


class RubberTetrahedra:
    """A held solid of one material: an `Elastic`.

    Args:
        shape: Nodes and elements at rest, and what is held.
        material: What it is made of.
    """

    # Of the part of the moduli below zero, that is taken away.
    stiffened = (1.0,)

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
        """The solid with its nodes at `x`; None where some J is not above `least`."""
        m, count = self._elements.shape
        F = x[self._elements].transpose(0, 2, 1) @ self._by_element  # (m, 3, 3 q)
        strain = strained(
            np.ascontiguousarray(F.reshape(m, 3, -1, 3).transpose(1, 3, 0, 2)).reshape(3, 3, -1),
            least,
        )
        if strain is None or not (self._least_volume(strain.J) > _FLOOR).all():
            return None
        energy = float(self._weights @ self.material.energy_density(strain))
        P = (self.material.stress(strain) * self._weights).reshape(3, 3, m, -1)
        force = self._by_element @ P.transpose(2, 3, 1, 0).reshape(m, -1, 3)  # (m, a, 3)
        return SolidState(x, strain, energy, np.asarray(self._sum @ force.reshape(m * count, 3)))

    def _least_volume(self, J: Floats) -> Floats:
        """Bound of J from below all over each element, shape (m, ...)."""
        by_element = J.reshape(len(self._elements), -1)
        if by_element.shape[1] == 1:
            return by_element
        return np.asarray(by_element[:, :20] @ self._bounds.T)

    def moved(self, state: SolidState, step: Floats, push: Floats) -> SolidState | None:
        """The state after a step; None if it leaves less than `_LEFT` of the volume somewhere."""
        del push
        return self.at(state.x + step, _LEFT * np.minimum(state.strain.J, 1.0))

    def unbalanced(self, state: SolidState, push: Floats) -> Floats:
        """What the solid leaves of the loads, shape (n, 3) [N]."""
        return np.asarray(push - state.force)

    def factored(self, state: SolidState, stiffening: float) -> SolidTangent:
        """The tangent, `stiffening` of what of its moduli is below zero taken away."""
        strain, m = state.strain, len(self._elements)
        h = np.einsum("apq,pjq->ajq", self._by_point, strain.inverse)
        turning = self._weights * self.material.turning(strain)
        entries = self._steady
        if stiffening:
            entries = entries + self._between(h, 0.5 * stiffening * np.abs(turning))
            turning = (1.0 - 0.5 * stiffening) * turning
        moduli = np.stack([self._weights * self.material.squeezing(strain), turning])
        # (m, 2, 3 a, q) by (m, 1, q, 3 a): both products of each element.
        rows = h.reshape(-1, m, h.shape[2] // m).transpose(1, 0, 2)
        left = rows[:, None] * moduli.reshape(2, m, 1, -1).swapaxes(0, 1)
        products = left.reshape(m, -1, rows.shape[2]) @ rows.swapaxes(1, 2)
        entries = entries + self._crossed @ products.ravel()
        try:
            return SolidTangent(Refactored(self._analysis, entries))
        except Indefinite as error:
            raise Unstable("the tangent is indefinite") from error

    def _between(self, h: Floats, moduli: Floats) -> Floats:
        """Entries of sum_q moduli (h_a . h_b) d_ij."""
        m, count = self._elements.shape
        rows = h.reshape(count, 3, m, -1).transpose(2, 0, 1, 3)  # (m, a, 3, q)
        left = rows * moduli.reshape(m, 1, 1, -1)
        products = left.reshape(m, count, -1) @ rows.reshape(m, count, -1).swapaxes(1, 2)
        return np.asarray(self._same @ products.ravel())


def _pattern(
    elements: Ints, nodes: Floats, free: Ints
) -> tuple[Analysis, sp.csr_array, sp.csr_array]:
    """The factor's pattern, and maps to its entries from the products of each element.

    Returns:
        The analysis; from products (m, a, a) to entries on both axes alike; from products
        (m, 2, 3 a, 3 a), the first as they are and the second with their axes crossed.
    """
    m, count = elements.shape
    place = np.full(len(nodes), -1, dtype=np.int64)
    place[free] = np.arange(len(free))
    size, width = 3 * len(free), 3 * count
    number = np.where(place[elements] < 0, -size, 3 * place[elements])
    unknown = (number[:, :, None] + np.arange(3)).reshape(m, width)
    row, column = np.repeat(unknown, width, axis=1).ravel(), np.tile(unknown, (1, width)).ravel()
    loose = (row >= 0) & (column >= 0)
    ones = np.ones(int(loose.sum()))
    matrix = sp.csr_array((ones, (row[loose], column[loose])), shape=(size, size))
    analysis = analyse(matrix, nodes[free])
    rows = np.repeat(np.arange(size), np.diff(matrix.indptr))[analysis.entries]
    keys = rows * size + matrix.indices[analysis.entries]
    order = np.argsort(keys)
    wanted = row * size + column
    at = np.minimum(np.searchsorted(keys[order], wanted), len(keys) - 1)
    kept = np.flatnonzero(loose & (keys[order][at] == wanted))
    entry = order[at[kept]]
    element, inside = kept // width**2, kept % width**2
    (a, i), (b, j) = divmod(inside // width, 3), divmod(inside % width, 3)
    as_is = 2 * element * width**2 + inside
    crossed = (2 * element + 1) * width**2 + (3 * a + j) * width + 3 * b + i
    alike = i == j
    between = element[alike] * count**2 + a[alike] * count + b[alike]
    return (
        analysis,
        _adding(entry[alike], between, (len(keys), m * count**2)),
        _adding(
            np.concatenate([entry, entry]),
            np.concatenate([as_is, crossed]),
            (len(keys), 2 * m * width**2),
        ),
    )


def _adding(to: Ints, source: Ints, shape: tuple[int, int]) -> sp.csr_array:
    """Sums of some elements of a vector."""
    return sp.csr_array((np.ones(len(to)), (to, source)), shape=shape)
