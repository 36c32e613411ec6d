"""A rubber sheet round water that cannot leave, as `settling.py` sees it.

A step goes along the surface of constant volume and is put back onto it. The pressure is the one
that balances best what rubber and loads leave over: unlike the sum of Newton's corrections it is
not led astray by a tangent next to singular.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cohaptic_server.bodies.balloon.constant_volume_solver import Band, HeldWater
from cohaptic_server.bodies.balloon.rubber_sheet import Sheet
from cohaptic_server.bodies.balloon.tension_field import Strained
from cohaptic_server.numeric import Floats, Ints


@dataclass(frozen=True, eq=False)
class WateredState:
    """A surface, not always in equilibrium.

    Args:
        x: Vertices, shape (n, 3) [m].
        strain: Of the rubber.
        energy: Of the rubber [J].
        force: That holds the rubber so, shape (n, 3) [N].
        g: dV/dx, shape (n, 3) [m^2].
        pressure: Of the water [Pa].
    """

    x: Floats
    strain: Strained
    energy: float
    force: Floats
    g: Floats
    pressure: float

    @property
    def carried(self) -> Floats:
        """Loads that would be in equilibrium with rubber and water, shape (n, 3) [N]."""
        return np.asarray(self.force - self.pressure * self.g)


class WateredSheet:
    """Sheet, water and base: an `Elastic`.

    Args:
        sheet: Rubber and water.
        dof: Unknowns in the order of the sheet's pattern, shape (f,), as indices into (3 n,).
        band: Pattern of the tangent.
        volume: Of the water [m^3].
    """

    # Of the mean diagonal; the last is above what the water can take away.
    stiffened = (0.03, 1.03)

    def __init__(self, sheet: Sheet, dof: Ints, band: Band, volume: float) -> None:
        self._sheet, self.dof, self._band, self._volume = sheet, dof, band, volume
        self._diagonal = np.flatnonzero(sheet.rows == sheet.columns)

    def at(self, x: Floats, pressure: float) -> WateredState:
        """A surface of which the pressure is known."""
        strain = self._sheet.strained(x)
        g = self._sheet.volume_gradient(x)
        return WateredState(
            x, strain, self._sheet.energy(strain), self._sheet.force(strain), g, pressure
        )

    def moved(self, state: WateredState, step: Floats, push: Floats) -> WateredState | None:
        """Moved and blown up or let down to the water's volume; None if it cannot be."""
        x, way = state.x + step, np.zeros_like(step)
        way.reshape(-1)[self.dof] = state.g.reshape(-1)[self.dof]
        g = self._sheet.volume_gradient(x)
        for _ in range(8):
            # The volume is a third of g . x (Euler, as it is homogeneous of degree 3).
            lost = float((g * x).sum()) / 3.0 - self._volume
            if abs(lost) < 1e-13 * self._volume:
                return self._under(x, g, push)
            rise = float((g * way).sum())
            if rise <= 0.0:
                return None
            x = x - (lost / rise) * way
            g = self._sheet.volume_gradient(x)
        return None

    def unbalanced(self, state: WateredState, push: Floats) -> Floats:
        """What rubber and water leave of the loads, shape (n, 3) [N]."""
        return np.asarray(push - state.carried)

    def factored(self, state: WateredState, stiffening: float) -> HeldWater:
        """The tangent, its diagonal raised by `stiffening` of its mean."""
        entries = self._sheet.tangent(state.strain, state.x, state.pressure)
        entries[self._diagonal] += stiffening * float(entries[self._diagonal].mean())
        return HeldWater(self._band, entries, state.g.reshape(-1)[self.dof])

    def _under(self, x: Floats, g: Floats, push: Floats) -> WateredState:
        strain = self._sheet.strained(x)
        force = self._sheet.force(strain)
        along = g.reshape(-1)[self.dof]
        over = (force - push).reshape(-1)[self.dof]
        pressure = float(along @ over) / float(along @ along)
        return WateredState(x, strain, self._sheet.energy(strain), force, g, pressure)
