"""A closed rubber sheet round water at any deformation: energy, forces and tangent."""

from __future__ import annotations

import numpy as np

from cohaptic_server.bodies.balloon.membrane import Membrane
from cohaptic_server.bodies.balloon.tension_field import (
    add_forces,
    add_pressure,
    add_tangents,
    add_volume_gradient,
    energy,
    strains,
)
from cohaptic_server.cholesky.symbolic import Analysis
from cohaptic_server.numeric import Floats, Ints


class RubberSheet:
    """A rubber sheet round water, with the unknowns in the order of an analysis.

    Args:
        membrane: The unstretched sheet.
        number: Index of each vertex among the free vertices, negative if fixed, shape (n,).
        analysis: Pattern of the tangent on the free vertices.

    Attributes:
        faces: Vertices of each triangle, shape (m, 3).
        analysis: As given.
    """

    def __init__(self, membrane: Membrane, number: Ints, analysis: Analysis) -> None:
        self.faces = np.ascontiguousarray(membrane.faces, dtype=np.int64)
        self.analysis = analysis
        self._size, self._mu_h = len(number), membrane.mu_h
        self._area = np.ascontiguousarray(membrane.rest_area)
        self._stiffness = self._area * membrane.mu_h
        self._gradients = np.ascontiguousarray(membrane.gradients)
        self._index = np.ascontiguousarray(analysis.blocks_of(number[self.faces]))

    def strain(self, x: Floats) -> Floats:
        """Strain of the triangles at `x`, shape (n, 3) [m], as in `tension_field.py`, (m, 10)."""
        out = np.empty((len(self.faces), 10))
        strains(np.ascontiguousarray(x), self.faces, self._gradients, out)
        return out

    def energy(self, strain: Floats) -> float:
        """Strain energy [J]."""
        return energy(strain, self._area) * self._mu_h

    def force(self, strain: Floats) -> Floats:
        """Nodal forces that keep the rubber in this strain, dE/dx, shape (n, 3) [N]."""
        out = np.zeros((self._size, 3))
        add_forces(strain, self.faces, self._gradients, self._stiffness, out)
        return out

    def volume_gradient(self, x: Floats) -> Floats:
        """dV/dx, shape (n, 3) [m^2]; V = (dV/dx . x) / 3 by Euler's theorem."""
        out = np.zeros((self._size, 3))
        add_volume_gradient(np.ascontiguousarray(x), self.faces, out)
        return out

    def tangent(self, strain: Floats, x: Floats, pressure: float) -> Floats:
        """Blocks of d2E/dx2 - p d2V/dx2 in the order of the analysis, shape (e, 9) [N/m]."""
        count = len(self.analysis.rows)
        blocks, scratch = np.zeros((count, 9)), np.empty(6)
        add_tangents(strain, self._gradients, self._stiffness, self._index, count, scratch, blocks)
        add_pressure(np.ascontiguousarray(x), self.faces, pressure, self._index, count, blocks)
        return blocks
