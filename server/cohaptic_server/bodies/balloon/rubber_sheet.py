"""A closed rubber sheet round water at any deformation: energy, forces and tangent, fast.

What the mesh fixes is put into sparse matrices once: deformation gradients are G x, vertex forces
G' P, and each entry of the tangent is a fixed combination of the triangles' moduli (and, for the
water, of the positions). A tick then does arithmetic on all triangles at a time and three products.
"""

from __future__ import annotations

import itertools

import numpy as np
import scipy.sparse as sp

from cohaptic_server.bodies.balloon.membrane import Membrane
from cohaptic_server.bodies.balloon.tension_field import (
    ENTRIES,
    Strained,
    energy_density,
    moduli,
    strained,
    stress,
)
from cohaptic_server.numeric import Floats, Ints, cross


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
        rubber, water = _Terms(dof, size), _Terms(dof, size)
        for e, (p, a, q, b) in enumerate(ENTRIES):
            for p1, a1, q1, b1 in sorted({(p, a, q, b), (q, b, p, a)}):  # it is symmetric
                for k, j in itertools.product(range(3), repeat=2):
                    factor = self._area * g[:, k, p1] * g[:, j, q1] * self.mu_h
                    rubber.add((k, a1), (j, b1), e * m + face, factor)
        sixth = np.full(m, 1.0 / 6.0)
        for k, a in itertools.product(range(3), repeat=2):
            j, i, b, c = (k + 1) % 3, (k + 2) % 3, (a + 1) % 3, (a + 2) % 3
            # Row k, column j, is -[x_i]x / 6 (enclosed_volume.py); column i has [x_j]x / 6.
            water.add((k, a), (j, c), 3 * faces[:, i] + b, -sixth)
            water.add((k, a), (j, b), 3 * faces[:, i] + c, sixth)
            water.add((k, a), (i, c), 3 * faces[:, j] + b, sixth)
            water.add((k, a), (i, b), 3 * faces[:, j] + c, -sixth)
        unique: Ints = np.unique(np.concatenate(rubber.keys))
        self._from_moduli = rubber.matrix(unique, len(ENTRIES) * m)
        self._from_positions = water.matrix(unique, number.size)
        self.rows, self.columns = unique // size, unique % size

    def strained(self, x: Floats) -> Strained:
        """Strain of the triangles at `x`, shape (n, 3) [m]."""
        F: Floats = np.asarray(self._G @ x).reshape(2, -1, 3)
        return strained(np.ascontiguousarray(F.transpose(0, 2, 1)))

    def energy(self, state: Strained) -> float:
        """Strain energy [J]."""
        return float(self._area @ energy_density(state)) * self.mu_h

    def force(self, state: Strained) -> Floats:
        """Force that holds the rubber so, dE/dx, shape (n, 3) [N]."""
        P = stress(state) * (self._area * self.mu_h)
        return np.asarray(self._Gt @ P.transpose(0, 2, 1).reshape(-1, 3))

    def volume_gradient(self, x: Floats) -> Floats:
        """dV/dx, shape (n, 3) [m^2]; V is a third of its product with x, from Euler."""
        a, b, c = x[self.faces[:, 0]], x[self.faces[:, 1]], x[self.faces[:, 2]]
        corners = np.concatenate([cross(b, c), cross(c, a), cross(a, b)])
        return np.asarray(self._corners @ corners) / 6.0

    def tangent(self, state: Strained, x: Floats, pressure: float) -> Floats:
        """Entries (`rows`, `columns`) of d2E/dx2 - p d2V/dx2 [N/m]."""
        K = self._from_moduli @ moduli(state).ravel()
        return np.asarray(K - pressure * (self._from_positions @ x.ravel()))


class _Terms:
    """Contributions to entries of the tangent: a factor times an element of some vector.

    Args:
        dof: Number of each unknown of each triangle, negative if held, shape (m, 3, 3).
        size: How many unknowns.
    """

    def __init__(self, dof: Ints, size: int) -> None:
        self._dof, self._size = dof, size
        self.keys = list[Ints]()
        self._sources, self._factors = list[Ints](), list[Floats]()

    def add(
        self, row: tuple[int, int], column: tuple[int, int], source: Ints, factor: Floats
    ) -> None:
        """One term of every triangle, between (corner, axis) and (corner, axis), if it is below."""
        r, c = self._dof[:, row[0], row[1]], self._dof[:, column[0], column[1]]
        keep = (r >= c) & (c >= 0)
        self.keys.append(r[keep] * self._size + c[keep])
        self._sources.append(source[keep])
        self._factors.append(factor[keep])

    def matrix(self, entries: Ints, length: int) -> sp.csr_array:
        """From the vector, of `length`, to the entries with the keys `entries`."""
        where = np.searchsorted(entries, np.concatenate(self.keys))
        values = np.concatenate(self._factors)
        at = (where, np.concatenate(self._sources))
        return sp.csr_array((values, at), shape=(len(entries), length))
