"""Hyperelastic tetrahedra at any deformation: energy, internal forces and tangent.

With J the determinant of the deformation gradient F, the energy is that of `hyperelastic.py`,

    W = mu / 2 (|F|^2 - 3) + U(J),    U = -(mu + lambda / 2) ln J + lambda / 4 (J^2 - 1),

with Lame's constants mu and lambda. The first part of W has a constant Hessian. The Hessian of the
volumetric part U is U'' dJ dJ + U' d2J: squares, and the
second derivative of a determinant, which is linear in F and acts as a cross product between one
node's displacement and another's force. A stiffened tangent leaves out the parts that can make it
indefinite. These are parts of the term s tr(L L), with the velocity gradient L and
s = mu - lambda / 2 (J^2 - 1): the part of the spin where s > 0, and of the strain where s < 0.

Everything that depends on the mesh alone is computed once. A tick passes over the elements in
batches that stay in the processor's cache.

No element inverts: `quadrature.py` gives a lower bound of J in each element, and a step that would
bring this bound below `_MIN_J` is refused.

The loops over corners and points use tables of the shape functions. The gradients of ten-node shape
functions are linear, so a deformation gradient F is interpolated from those at the corners c,
F = sum_c L_c F_c, with the barycentric coordinates L_c. Four-node elements have one quadrature
point and one such corner.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from cohaptic_server.bodies.hyperelastic import IndefiniteTangentError, NeoHookean
from cohaptic_server.bodies.rubber_solid.element_loops import (
    add_tangents,
    corner_gradients,
    moduli,
    nodal_forces,
    stresses,
    turns,
)
from cohaptic_server.bodies.rubber_solid.quadrature import (
    bounds,
    lattice,
    shape_gradients,
    weights,
    whole_bounds,
)
from cohaptic_server.bodies.solid.shape import SolidShape
from cohaptic_server.cholesky.refactor import Indefinite
from cohaptic_server.cholesky.refined import Refined, Workspaces
from cohaptic_server.cholesky.symbolic import analyse
from cohaptic_server.mesh.tetrahedra import gradients, volumes
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.side_by_side import both


@dataclass(frozen=True, eq=False)
class ShapeTables:
    """Tables of shape functions for a nodes, c corners, r pairs of corners, q quadrature points.

    Args:
        interpolation: Shape functions of the corners at the points, shape (c, q).
        products: Products of each pair of these functions, shape (r, q).
        nodes: Node that, with node s, determines y_s = dx/dL_s at each corner, shape (c, 4); L_s
            is a barycentric coordinate.
        factors: Factor of that node in y_s, and factor of node s, shape (c, 4, 2).
        terms: Numbers of the barycentric coordinates in each shape function, shape (a, 2).
        shapes: Derivatives of each shape function by these coordinates at the points, (a, 2, q).
        turning: Matrix from the vectors of `element_loops.turns`, shape (6 r), to those of the
            pairs of nodes, shape (6 r, a (a + 1) / 2).
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
        """Return the tables for elements of `count` nodes, 4 or 10."""
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
    """Return `nodes` and `factors` of `ShapeTables`.

    Args:
        at_corners: Derivatives dN_a/dL_s of the shape functions at the corners, shape (c, a, 4).
    """
    corners = len(at_corners)
    nodes, factors = np.zeros((corners, 4), dtype=np.int64), np.zeros((corners, 4, 2))
    for c, s in itertools.product(range(corners), range(4)):
        others = [a for a in np.flatnonzero(at_corners[c, :, s]).tolist() if a != s]
        nodes[c, s] = others[0] if others else s
        factors[c, s, 0] = at_corners[c, others[0], s] if others else 0.0
        factors[c, s, 1] = at_corners[c, s, s]
    return nodes, factors


def _terms(D: Floats) -> Ints:
    """Return the numbers of the one or two coordinates in each shape function, shape (a, 2)."""
    found = [np.flatnonzero(np.abs(D[:, a]).max(axis=0)) for a in range(D.shape[1])]
    return np.array([[s[0], s[-1]] for s in found], dtype=np.int64)


def _turning(at_corners: Floats, pairs: list[tuple[int, int]]) -> Floats:
    """Return the sums of  dN_a/dL_s dN_b/dL_t - dN_a/dL_t dN_b/dL_s  for each pair of corners."""
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


def removed(material: NeoHookean, swell: Floats, weighted: Floats, J: Floats) -> Floats:
    """Return the fully stiffened tangent less the exact one, shape (k, 3 a, 3 a) [N/m].

    With s of the module's head, and the gradients h_a of the shape functions in the present state,
    and Kronecker's d_ij, the difference is 1/2 (|s| (h_a . h_b) d_ij - s h_aj h_bi) at each point.

    Args:
        material: mu and lambda of these elements, shape (k,) [Pa].
        swell: J h, the `swell` of `element_loops.moduli`, shape (k, q, 3 a).
        weighted: w U'' J h, the `weighted` of `element_loops.moduli`, shape (k, 3 a, q).
        J: Determinants at the quadrature points, shape (k, q).
    """
    mu, lame = material.mu[:, None], material.lame[:, None]
    s = mu - 0.5 * lame * (J - 1.0) * (J + 1.0)
    fraction = 0.5 * s / (mu + 0.5 * lame * (1.0 + J * J))  # over U'' J^2
    k, _, width = swell.shape
    shape = (k, width // 3, 3, width // 3, 3)
    crossed = ((weighted * fraction[:, None]) @ swell).reshape(shape).transpose(0, 1, 4, 3, 2)
    between = np.einsum(
        "kaibi->kab", ((weighted * np.abs(fraction)[:, None]) @ swell).reshape(shape)
    )
    removed = -crossed
    for axis in range(3):
        removed[:, :, axis, :, axis] += between
    return np.asarray(removed.reshape(k, width, width))


# Smallest share of J (or of 1 if J is larger) that must be left after a step at every point: the
# fraction-to-the-boundary rule of interior point methods.
_MIN_FRACTION = 0.1
_MIN_J = 0.01  # least J anywhere in an element
_WORTH_TWO_THREADS = 500  # elements; with fewer, waking a second thread costs more than it saves
_BATCH = 64  # elements, whose tangents, 460 kB, stay in the processor's cache


@dataclass(frozen=True, eq=False)
class SolidState:
    """A deformed solid, not necessarily in equilibrium.

    Args:
        x: Positions of the nodes, shape (n, 3) [m].
        corners: Deformation gradients at the corners of the elements, shape (m, 9, c).
        J: Determinants of the deformation gradients at the quadrature points, shape (m, q).
        energy: Stored energy [J].
        internal_force: Gradient dE/dx of the energy, shape (n, 3) [N].
    """

    x: Floats
    corners: Floats
    J: Floats
    energy: float
    internal_force: Floats


@dataclass(frozen=True, eq=False)
class SolidTangent:
    """A factored tangent, as a `TangentSolver`."""

    factor: Refined

    def displacements(self, b: Floats) -> Floats:
        """Solve for the displacements of the unknowns under forces on them.

        Args:
            b: Forces in c load cases, shape (c, size) [N].

        Returns:
            Displacements, shape (c, size) [m].
        """
        return np.ascontiguousarray(self.factor.solve(np.ascontiguousarray(b.T)).T)

    def step(self, b: Floats) -> Floats:
        """Solve as `displacements` does, but in single precision."""
        return np.ascontiguousarray(self.factor.approximate(np.ascontiguousarray(b.T)).T)


class RubberTetrahedra:
    """A solid with some fixed nodes, as a `Hyperelastic` body.

    Args:
        shape: Nodes and elements at rest, and the fixed nodes.
        material: The hyperelastic material of each element.

    Attributes:
        material: As given.
        dof: Indices of the unknowns among the 3 n coordinates, in the factor's order, (size,).
    """

    # Shares of the negative part of the moduli that a stiffened tangent leaves out.
    stiffenings = (1.0,)

    def __init__(self, shape: SolidShape, material: NeoHookean) -> None:
        tets, nodes, elements = shape.tets, shape.nodes, shape.elements
        self.material, self._elements = material, np.ascontiguousarray(elements)
        self._size, count = len(nodes), elements.shape[1]
        self._tables = tables = ShapeTables.of(count)
        self._whole_bounds, self._bounds = whole_bounds(), bounds()
        self._gradients = g = np.ascontiguousarray(gradients(tets.vertices, tets.tets))
        s, t = np.triu_indices(4, 1)
        self._normals = np.ascontiguousarray(np.cross(g[:, s], g[:, t]))
        points = tables.interpolation.shape[1]
        self._weights = volumes(tets.vertices, tets.tets)[:, None] * weights(points)
        free = np.flatnonzero(~shape.fixed)
        number = np.full(len(nodes), -1, dtype=np.int64)
        number[free] = np.arange(len(free))
        self._analysis = analyse(number[elements], nodes[free])
        self._workspaces = Workspaces(self._analysis)
        order = free[self._analysis.order]
        self.dof = np.asarray((3 * order[:, None] + np.arange(3)).ravel(), dtype=np.int64)
        self._index = np.ascontiguousarray(self._analysis.blocks_of(number[elements]))
        self._steady = self._constant_part()

    def _constant_part(self) -> Floats:
        """Return the blocks of the Hessian of mu / 2 |F|^2, shape (e, 9) [N/m]."""
        table, g = self._tables, self._gradients
        count = self._elements.shape[1]
        slopes = np.zeros((len(g), count, 3, self._weights.shape[1]))
        for a, (s, t) in enumerate(table.terms.tolist()):
            slopes[:, a] = g[:, s, :, None] * table.shapes[a, 0]
            slopes[:, a] += g[:, t, :, None] * table.shapes[a, 1]
        row, column = np.tril_indices(count)
        weights = self.material.mu[:, None] * self._weights
        products = np.einsum("mapq,mbpq,mq->mab", slopes, slopes, weights, optimize=True)
        blocks = np.zeros((len(self._analysis.rows) + 1, 9))
        index = np.where(self._index < 0, -1 - self._index, self._index)
        for axis in (0, 4, 8):
            np.add.at(blocks[:, axis], index, products[:, row, column])
        return blocks[:-1].copy()

    def gradients_at(self, state: SolidState) -> Floats:
        """Return the deformation gradients at the quadrature points, shape (m, q, 3, 3)."""
        F = state.corners @ self._tables.interpolation
        return np.asarray(F.transpose(0, 2, 1).reshape(*state.J.shape, 3, 3))

    def state(self, x: Floats, least: Floats | float = 0.0) -> SolidState | None:
        """Return the state of the solid with its nodes at `x`.

        Args:
            x: Positions of the nodes, shape (n, 3) [m].
            least: Lower bound of the determinant J, one for all points or one for each, (m, q).

        Returns:
            The state; None if J is not above `least` at a point, or its bound not above `_MIN_J`.
        """
        x = np.ascontiguousarray(x)
        m, points = self._weights.shape
        corners, J = np.empty((m, 9, len(self._tables.nodes))), np.empty((m, points))

        def part(begin: int, end: int) -> tuple[float, Floats]:
            return self._evaluate(x, begin, end, corners, J)

        if m < _WORTH_TWO_THREADS:
            energy, internal = part(0, m)
        else:
            (energy, internal), (more, others) = both(
                lambda: part(0, m // 2), lambda: part(m // 2, m)
            )
            energy += more
            internal += others
        # Written as a negation, so that NaN is refused, too.
        if not (least < J).all() or not self._is_bounded(J):
            return None
        log_part = self.material.mu + 0.5 * self.material.lame
        energy -= float(log_part @ (self._weights * np.log(J)).sum(axis=1))
        return SolidState(x, corners, J, energy, internal)

    def _evaluate(
        self, x: Floats, begin: int, end: int, corners: Floats, J: Floats
    ) -> tuple[float, Floats]:
        """Write deformation gradients and determinants of some elements to `corners` and `J`.

        Args:
            x: Positions of the nodes, shape (n, 3) [m].
            begin, end: First element, and the one after the last.
            corners, J: As in `SolidState`.

        Returns:
            Energy of these elements without its logarithmic part [J], and their nodal forces [N].
        """
        tables, material, run = self._tables, self.material, slice(begin, end)
        given = self._elements[run], self._gradients[run], tables.nodes, tables.factors
        corner_gradients(x, *given, corners[run])
        moments = np.empty_like(corners[run])
        cofactor, energy = np.empty(9), 0.0
        to_corners = np.ascontiguousarray(tables.interpolation.T)
        for start in range(begin, end, _BATCH):
            batch = slice(start, min(start + _BATCH, end))
            F = _times(corners[batch], tables.interpolation)
            mu, lame = material.mu[batch], material.lame[batch]
            energy += stresses(F, self._weights[batch], mu, lame, J[batch], cofactor)
            moments[start - begin : batch.stop - begin] = _times(F, to_corners)
        internal = np.zeros((self._size, 3))
        nodal_forces(moments, *given, internal)
        return energy, internal

    def _is_bounded(self, J: Floats) -> bool:
        """Return whether the determinant J exceeds `_MIN_J` throughout each element.

        Args:
            J: Determinants at the quadrature points, shape (m, q).
        """
        if J.shape[1] == 1:
            return bool((J > _MIN_J).all())
        # The bounds of whole elements come first: the bounds of their parts are nowhere lower.
        coarse = J[:, :20] @ self._whole_bounds.T
        doubtful = ~(coarse > _MIN_J).all(axis=1)
        return bool((J[doubtful, :20] @ self._bounds.T > _MIN_J).all())

    def displaced(self, state: SolidState, step: Floats, external: Floats) -> SolidState | None:
        """Return the state after a step; None if J falls below its limits, as for `at`."""
        del external
        return self.state(state.x + step, _MIN_FRACTION * np.minimum(state.J, 1.0))

    def residual(self, state: SolidState, external: Floats) -> Floats:
        """Return the external forces less the internal forces, shape (n, 3) [N]."""
        return np.asarray(external - state.internal_force)

    def factor_tangent(
        self, state: SolidState, stiffening: float, b: Floats
    ) -> tuple[SolidTangent, Floats]:
        """Factor the tangent, and solve with the factor.

        Args:
            state: The deformed solid.
            stiffening: Share of the negative part of the moduli that is left out, 0 to 1.
            b: Forces on the unknowns, shape (c, size) [N].

        Returns:
            The factor, and the displacements of the unknowns under `b`, shape (c, size) [m].
        """
        try:
            factor = Refined(self._workspaces, self.tangent(state, stiffening))
            found = factor.checked(np.ascontiguousarray(b.T))
        except Indefinite as error:
            raise IndefiniteTangentError("the tangent is indefinite") from error
        return SolidTangent(factor), np.ascontiguousarray(found.T)

    def tangent(self, state: SolidState, stiffening: float = 0.0) -> Floats:
        """Return the blocks of the tangent in the order of the factor, shape (e, 9) [N/m].

        Args:
            state: The deformed solid.
            stiffening: Share of the negative part of the moduli that is left out, 0 to 1.
        """
        m = len(self._weights)
        if m < _WORTH_TWO_THREADS:
            return self._tangent(state, stiffening, 0, m, self._steady.copy())
        half = m // 2
        blocks, others = both(
            lambda: self._tangent(state, stiffening, 0, half, self._steady.copy()),
            lambda: self._tangent(state, stiffening, half, m, np.zeros_like(self._steady)),
        )
        blocks += others
        return blocks

    def _tangent(
        self, state: SolidState, stiffening: float, begin: int, end: int, blocks: Floats
    ) -> Floats:
        """Add the tangents of elements `begin` to `end` - 1 to `blocks`, and return `blocks`."""
        tables, material = self._tables, self.material
        points = self._weights.shape[1]
        count = self._elements.shape[1]
        products = np.ascontiguousarray(tables.products.T)
        pairs = products.shape[1]
        cofactor, scratch = np.empty(9), np.empty((22, points))
        swell = np.empty((_BATCH, points, 3 * count))
        weighted = np.empty((_BATCH, 3 * count, points))
        turned = np.empty((_BATCH, 3, pairs, 6))
        for start in range(begin, end, _BATCH):
            batch = slice(start, min(start + _BATCH, end))
            k = batch.stop - start
            of_batch = NeoHookean(material.mu[batch], material.lame[batch])
            F = _times(state.corners[batch], tables.interpolation)
            moduli(
                F,
                self._gradients[batch],
                self._weights[batch],
                tables.shapes,
                tables.terms,
                of_batch.mu,
                of_batch.lame,
                cofactor,
                scratch,
                swell,
                weighted,
            )
            turns(_times(F, products), self._normals[batch], turned)
            # Separate arrays: for an array and its own transpose BLAS takes three times as long.
            squares = weighted[:k] @ swell[:k]
            if stiffening:
                squares += stiffening * removed(of_batch, swell[:k], weighted[:k], state.J[batch])
            add_tangents(
                squares,
                _times(turned[:k].reshape(k, 3, -1), tables.turning),
                self._index[batch],
                count,
                len(blocks),
                blocks,
            )
        return blocks


def _times(stack: Floats, matrix: Floats) -> Floats:
    """Return the product of each matrix of a stack (m, k, c) with one matrix (c, q)."""
    m, k, c = stack.shape
    return np.asarray((stack.reshape(m * k, c) @ matrix).reshape(m, k, -1))
