"""A rubber sheet round a constant volume of water, for the Newton iteration.

A step is tangent to the surface of constant volume and then projected onto it. The pressure is the
least-squares balance of rubber and loads: unlike the sum of Newton's corrections it does not drift
when a tangent is close to singular.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cohaptic_server.bodies.balloon.constant_volume_solver import ConstantVolumeFactor
from cohaptic_server.bodies.balloon.rubber_sheet import RubberSheet
from cohaptic_server.cholesky.refactor import Workspace
from cohaptic_server.numeric import Floats, Ints


@dataclass(frozen=True, eq=False)
class FilledState:
    """A deformed surface, not necessarily in equilibrium.

    Args:
        x: Vertices, shape (n, 3) [m].
        strain: Strain of the rubber, as in `tension_field.py`, shape (m, 10).
        energy: Energy of the rubber [J].
        rubber_force: Nodal forces that keep the rubber in this shape, dE/dx, shape (n, 3) [N].
        g: dV/dx, shape (n, 3) [m^2].
        pressure: Pressure of the water [Pa].
    """

    x: Floats
    strain: Floats
    energy: float
    rubber_force: Floats
    g: Floats
    pressure: float

    @property
    def internal_force(self) -> Floats:
        """External forces that would be in equilibrium with rubber and water, shape (n, 3) [N]."""
        return np.asarray(self.rubber_force - self.pressure * self.g)


class FilledSheet:
    """Sheet, water and base: a `Hyperelastic` body.

    Args:
        sheet: Rubber and water.
        dof: Unknowns in the order of the sheet's analysis, as indices into (3 n,), shape (f,).
        volume: Volume of the water [m^3].
    """

    # Shares of the mean diagonal; the last exceeds the negative stiffness of the water's pressure.
    stiffenings = (0.03, 1.03)

    def __init__(self, sheet: RubberSheet, dof: Ints, volume: float) -> None:
        self._sheet, self.dof, self._volume = sheet, dof, volume
        self._workspace = Workspace(sheet.analysis)

    def at(self, x: Floats, pressure: float) -> FilledState:
        """The state at vertices `x`, shape (n, 3) [m], and a known pressure [Pa]."""
        strain = self._sheet.strain(x)
        g = self._sheet.volume_gradient(x)
        return FilledState(
            x, strain, self._sheet.energy(strain), self._sheet.force(strain), g, pressure
        )

    def displaced(self, state: FilledState, step: Floats, external: Floats) -> FilledState | None:
        """The state after a step, projected onto the water's volume; None if that fails.

        The projection moves the vertices along dV/dx, by Newton's method.
        """
        x, direction = state.x + step, np.zeros_like(step)
        direction.reshape(-1)[self.dof] = state.g.reshape(-1)[self.dof]
        g = self._sheet.volume_gradient(x)
        for _ in range(8):
            # V = g . x / 3 by Euler's theorem, as V is homogeneous of degree 3.
            excess = float((g * x).sum()) / 3.0 - self._volume
            if abs(excess) < 1e-13 * self._volume:
                return self._balanced(x, g, external)
            rise = float((g * direction).sum())
            if rise <= 0.0:
                return None
            x = x - (excess / rise) * direction
            g = self._sheet.volume_gradient(x)
        return None

    def residual(self, state: FilledState, external: Floats) -> Floats:
        """External forces less those of rubber and water, shape (n, 3) [N]."""
        return np.asarray(external - state.internal_force)

    def factor_tangent(
        self, state: FilledState, stiffening: float, b: Floats
    ) -> tuple[ConstantVolumeFactor, Floats]:
        """Factor the tangent, its diagonal raised by `stiffening` times its mean."""
        blocks = self._sheet.tangent(state.strain, state.x, state.pressure)
        if stiffening:
            # The first block of each column is the one on the diagonal.
            diagonal = self._sheet.analysis.starts[:-1, None], np.array([[0, 4, 8]])
            blocks[diagonal] += stiffening * float(blocks[diagonal].mean())
        along = state.g.reshape(-1)[self.dof]
        factor = ConstantVolumeFactor(self._workspace, blocks, along)
        return factor, factor.displacements(b)

    def _balanced(self, x: Floats, g: Floats, external: Floats) -> FilledState:
        """The state at `x` with the pressure that balances rubber and loads best."""
        strain = self._sheet.strain(x)
        force = self._sheet.force(strain)
        along = g.reshape(-1)[self.dof]
        imbalance = (force - external).reshape(-1)[self.dof]
        pressure = float(along @ imbalance) / float(along @ along)
        return FilledState(x, strain, self._sheet.energy(strain), force, g, pressure)
