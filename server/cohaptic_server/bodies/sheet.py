"""A closed rubber sheet round water at any deformation: energy, forces and tangent, fast.

What the mesh fixes is put into sparse matrices once: deformation gradients are G x, vertex forces
G' P, and each entry of the tangent is a fixed combination of the triangles' moduli (and, for the
water, of the positions). A tick then does arithmetic on all triangles at a time and three products.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from cohaptic_server.bodies import tension_field as rubber
from cohaptic_server.bodies.membrane import Membrane
from cohaptic_server.bodies.mesh import Floats, Ints, cross


class Sheet:
    """Rubber and water on `n` vertices; entries of the tangent on a pattern chosen by the solver.

    Args:
        membrane: The unstretched sheet.
        n: Number of vertices.
        number: Of each unknown, shape (3 n,); negative for one that is held.
    """

    def __init__(self, membrane: Membrane, n: int, number: Ints) -> None:
        faces, g = membrane.faces, membrane.gradients  # (m, 3), (m, 3, 2)
        m = len(faces)
        self.faces, self.mu_h = faces, membrane.mu_h
        self._area = membrane.rest_area
        rows = (np.arange(m)[:, None] + m * np.arange(2)).repeat(3, axis=0)  # (3 m, 2)
        columns = np.repeat(faces.ravel(), 2)
        self._G = sp.csr_array((g.ravel(), (rows.ravel(), columns)), shape=(2 * m, n))
        self._Gt = sp.csr_array(self._G.T)
        self._corners = sp.csr_array(
            (np.ones(3 * m), (faces.T.ravel(), np.arange(3 * m))), shape=(n, 3 * m)
        )
        self._pattern(g, number)

    def _pattern(self, g: Floats, number: Ints) -> None:
        """Maps from moduli and positions to the entries of the lower triangle of the tangent."""
        faces, m = self.faces, len(self.faces)
        size = int(number.max()) + 1
        dof = number.reshape(-1, 3)[faces]  # (m, 3, 3)
        face = np.arange(m)
        keys, sources, factors = list[Ints](), list[Ints](), list[Floats]()

        def add(k: int, a: int, j: int, b: int, source: Ints, factor: Floats) -> None:
            row, column = dof[:, k, a], dof[:, j, b]
            keep = (row >= column) & (column >= 0)
            keys.append(row[keep] * size + column[keep])
            sources.append(source[keep])
            factors.append(factor[keep])

        for e, (p, a, q, b) in enumerate(rubber.ENTRIES):
            pairs = {(p, a, q, b), (q, b, p, a)}  # the tensor is symmetric
            for p1, a1, q1, b1 in sorted(pairs):
                for k in range(3):
                    for j in range(3):
                        weight = self._area * g[:, k, p1] * g[:, j, q1] * self.mu_h
                        add(k, a1, j, b1, e * m + face, weight)
        rubber_keys = np.concatenate(keys)
        unique, inverse = np.unique(rubber_keys, return_inverse=True)
        self._from_moduli = sp.csr_array(
            (np.concatenate(factors), (inverse, np.concatenate(sources))),
            shape=(len(unique), len(rubber.ENTRIES) * m),
        )
        keys, sources, factors = [], [], []
        for k in range(3):
            j, i = (k + 1) % 3, (k + 2) % 3
            for a in range(3):
                b, c = (a + 1) % 3, (a + 2) % 3
                sixth = np.full(m, 1.0 / 6.0)
                # Row k, column j, is -[x_i]x / 6 (enclosed_volume.py); column i has [x_j]x / 6.
                add(k, a, j, c, 3 * faces[:, i] + b, -sixth)
                add(k, a, j, b, 3 * faces[:, i] + c, sixth)
                add(k, a, i, c, 3 * faces[:, j] + b, sixth)
                add(k, a, i, b, 3 * faces[:, j] + c, -sixth)
        where = np.searchsorted(unique, np.concatenate(keys))
        self._from_positions = sp.csr_array(
            (np.concatenate(factors), (where, np.concatenate(sources))),
            shape=(len(unique), number.size),
        )
        self.rows, self.columns = unique // size, unique % size

    def strained(self, x: Floats) -> rubber.Strained:
        """Strain of the triangles at `x`, shape (n, 3) [m]."""
        F = (self._G @ x).reshape(2, -1, 3)
        return rubber.strained(np.ascontiguousarray(F.transpose(0, 2, 1)))

    def energy(self, state: rubber.Strained) -> float:
        """Strain energy [J]."""
        return float(self._area @ rubber.energy_density(state)) * self.mu_h

    def force(self, state: rubber.Strained) -> Floats:
        """Force that holds the rubber so, dE/dx, shape (n, 3) [N]."""
        P = rubber.stress(state) * (self._area * self.mu_h)
        return np.asarray(self._Gt @ P.transpose(0, 2, 1).reshape(-1, 3))

    def volume_gradient(self, x: Floats) -> Floats:
        """dV/dx, shape (n, 3) [m^2]; V is a third of its product with x, from Euler."""
        a, b, c = x[self.faces[:, 0]], x[self.faces[:, 1]], x[self.faces[:, 2]]
        corners = np.concatenate([cross(b, c), cross(c, a), cross(a, b)])
        return np.asarray(self._corners @ corners) / 6.0

    def tangent(self, state: rubber.Strained, x: Floats, pressure: float) -> Floats:
        """Entries (`rows`, `columns`) of d2E/dx2 - p d2V/dx2 [N/m]."""
        K = self._from_moduli @ rubber.moduli(state).ravel()
        return np.asarray(K - pressure * (self._from_positions @ x.ravel()))
