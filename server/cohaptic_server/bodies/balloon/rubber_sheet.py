"""A closed rubber sheet round water at any deformation: energy, forces and tangent, fast.

Everything that depends on the mesh alone is put into sparse matrices once:
deformation gradients are G x, vertex forces G' P, and each entry of the tangent is a fixed
combination of the triangles' moduli (and, for the water, of the positions). A tick then works on
all triangles at once, with three sparse products.
"""

from __future__ import annotations

import itertools

import numpy as np
import scipy.sparse as sp

from cohaptic_server.bodies.balloon.membrane import Membrane
from cohaptic_server.bodies.balloon.tension_field import (
    ENTRIES,
    MembraneStrain,
    energy_density,
    membrane_strain,
    moduli,
    stress,
)
from cohaptic_server.numeric import Floats, Ints, cross


class RubberSheet:
    """Rubber and water on `n` vertices; the numbering of the unknowns is the solver's.

    Args:
        membrane: The unstretched sheet.
        n: Number of vertices.
        number: Number of each degree of freedom among the unknowns, shape (3 n,); negative for a
            fixed one.

    Attributes:
        rows: Rows of the tangent's entries, lower triangle, shape (e,).
        columns: Their columns, shape (e,).
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
            # Both halves of the symmetric moduli.
            for p1, a1, q1, b1 in sorted({(p, a, q, b), (q, b, p, a)}):
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

    def strain(self, x: Floats) -> MembraneStrain:
        """Strain of the triangles at `x`, shape (n, 3) [m]."""
        F: Floats = np.asarray(self._G @ x).reshape(2, -1, 3)
        return membrane_strain(np.ascontiguousarray(F.transpose(0, 2, 1)))

    def energy(self, state: MembraneStrain) -> float:
        """Strain energy [J]."""
        return float(self._area @ energy_density(state)) * self.mu_h

    def force(self, state: MembraneStrain) -> Floats:
        """Nodal forces that keep the rubber in this state, dE/dx, shape (n, 3) [N]."""
        P = stress(state) * (self._area * self.mu_h)
        return np.asarray(self._Gt @ P.transpose(0, 2, 1).reshape(-1, 3))

    def volume_gradient(self, x: Floats) -> Floats:
        """dV/dx, shape (n, 3) [m^2]; V = (dV/dx . x) / 3 by Euler's theorem."""
        a, b, c = x[self.faces[:, 0]], x[self.faces[:, 1]], x[self.faces[:, 2]]
        corners = np.concatenate([cross(b, c), cross(c, a), cross(a, b)])
        return np.asarray(self._corners @ corners) / 6.0

    def tangent(self, state: MembraneStrain, x: Floats, pressure: float) -> Floats:
        """Entries (`rows`, `columns`) of d2E/dx2 - p d2V/dx2 [N/m]."""
        K = self._from_moduli @ moduli(state).ravel()
        return np.asarray(K - pressure * (self._from_positions @ x.ravel()))


class _Terms:
    """Contributions to entries of the tangent: a factor times an element of some vector.

    Args:
        dof: Number of each unknown of each triangle, negative if fixed, shape (m, 3, 3).
        size: Number of unknowns.
    """

    def __init__(self, dof: Ints, size: int) -> None:
        self._dof, self._size = dof, size
        self.keys = list[Ints]()
        self._sources, self._factors = list[Ints](), list[Floats]()

    def add(
        self, row: tuple[int, int], column: tuple[int, int], source: Ints, factor: Floats
    ) -> None:
        """Add a term of every triangle to (corner, axis) by (corner, axis), in the lower triangle.

        Args:
            row: Corner and axis of the row.
            column: Corner and axis of the column.
            source: Element of the vector for each triangle, shape (m,).
            factor: Its factor, shape (m,).
        """
        r, c = self._dof[:, row[0], row[1]], self._dof[:, column[0], column[1]]
        keep = (r >= c) & (c >= 0)
        self.keys.append(r[keep] * self._size + c[keep])
        self._sources.append(source[keep])
        self._factors.append(factor[keep])

    def matrix(self, entries: Ints, length: int) -> sp.csr_array:
        """The matrix from the vector, of `length`, to the entries with the keys `entries`."""
        where = np.searchsorted(entries, np.concatenate(self.keys))
        values = np.concatenate(self._factors)
        at = (where, np.concatenate(self._sources))
        return sp.csr_array((values, at), shape=(len(entries), length))
