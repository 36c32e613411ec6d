"""The water balloon under finite deformation: its rubber wrinkles, its water keeps the volume.

This is the nonlinear counterpart of `balloon.py`: the same inflated balloon, but with energy,
forces and volume at the present positions (`rubber_sheet.py`). Each tick iterates (`newton.py`)
under the contacts' forces as dead loads, which keep their directions while the surface moves.
`fields` and `compliance` are those of the tangent at the present state (science 3.6); while the
surface moves, the tangent may lag by `newton.CHORD`.

With a damping B_o the body is Kelvin-Voigt as in eq. (9), with B_o in proportion to K_o
(`viscous.py`): the internal force follows the external one with a lag.

The Newton iteration moves a rubber sheet round a constant volume of water. In the space of vertex
positions, a step is tangent to the manifold of constant volume and is then projected onto this
manifold. The pressure is the least-squares balance of rubber and loads: unlike the sum of Newton's
corrections, it does not drift when a tangent is close to singular.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cohaptic.errors import BodyError
from cohaptic_server.bodies.balloon.balloon import BalloonSettings, fixed_by_base, inflate
from cohaptic_server.bodies.balloon.constant_volume_solver import (
    ConstantVolumeFactor,
    order_from_base,
)
from cohaptic_server.bodies.balloon.membrane import Membrane
from cohaptic_server.bodies.balloon.rubber_sheet import RubberSheet
from cohaptic_server.bodies.body import Load, Response
from cohaptic_server.bodies.damping import check_damping, lagged
from cohaptic_server.bodies.finite_response import FiniteResponse
from cohaptic_server.bodies.newton import Iterate, NewtonIteration
from cohaptic_server.cholesky.refactor import Workspace
from cohaptic_server.cholesky.symbolic import analyse, dofs
from cohaptic_server.mesh.enclosed_volume import volume
from cohaptic_server.mesh.icosphere import icosphere
from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.numeric import Floats, Ints


@dataclass(frozen=True, eq=False)
class FilledState:
    """A deformed balloon, not necessarily in equilibrium.

    Args:
        x: Positions of the vertices, shape (n, 3) [m].
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
        """External forces that would balance rubber and water, shape (n, 3) [N]."""
        return np.asarray(self.rubber_force - self.pressure * self.g)


class FilledSheet:
    """A rubber sheet on a fixed base, filled with water, as a `Hyperelastic` body.

    Args:
        sheet: Energy, forces and tangent of the rubber round the water.
        dof: Indices of the unknowns among the 3 n coordinates, in the order of the sheet's
            analysis, shape (size,).
        volume: Volume of the water [m^3].
    """

    # Shares of the mean diagonal; the last one exceeds the negative stiffness that the water adds.
    stiffenings = (0.03, 1.03)

    def __init__(self, sheet: RubberSheet, dof: Ints, volume: float) -> None:
        self._sheet, self.dof, self._volume = sheet, dof, volume
        self._workspace = Workspace(sheet.analysis)

    def at(self, x: Floats, pressure: float) -> FilledState:
        """Returns the state at vertex positions `x` (n, 3) [m], with a known pressure [Pa]."""
        strain = self._sheet.strain(x)
        g = self._sheet.volume_gradient(x)
        return FilledState(
            x, strain, self._sheet.energy(strain), self._sheet.force(strain), g, pressure
        )

    def displaced(self, state: FilledState, step: Floats, external: Floats) -> FilledState | None:
        """Returns the state after a step, projected onto the water's volume; None if that fails.

        The projection moves the free vertices along dV/dx of `state`, by Newton's method.
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
        """External forces less the internal forces of rubber and water, shape (n, 3) [N]."""
        return np.asarray(external - state.internal_force)

    def factor_tangent(
        self, state: FilledState, stiffening: float, b: Floats
    ) -> tuple[ConstantVolumeFactor, Floats]:
        """Factor the tangent, with its diagonal raised by `stiffening` times the mean diagonal."""
        blocks = self._sheet.tangent(state.strain, state.x, state.pressure)
        if stiffening:
            # The first block of each column is the one on the diagonal.
            diagonal = self._sheet.analysis.starts[:-1, None], np.array([[0, 4, 8]])
            blocks[diagonal] += stiffening * float(blocks[diagonal].mean())
        along = state.g.reshape(-1)[self.dof]
        factor = ConstantVolumeFactor(self._workspace, blocks, along)
        return factor, factor.displacements(b)

    def _balanced(self, x: Floats, g: Floats, external: Floats) -> FilledState:
        """Returns the state at `x` with the pressure that best balances rubber and loads."""
        strain = self._sheet.strain(x)
        force = self._sheet.force(strain)
        along = g.reshape(-1)[self.dof]
        imbalance = (force - external).reshape(-1)[self.dof]
        pressure = float(along @ imbalance) / float(along @ along)
        return FilledState(x, strain, self._sheet.energy(strain), force, g, pressure)


# Shares of the vertices in the cap, tried in turn. Far past its pressure maximum a balloon needs a
# larger cap for the other vertices to be positive definite; but a larger cap costs more.
_CAPS = (0.14, 0.3, 0.5)


@dataclass(frozen=True, eq=False)
class RubberResponse(FiniteResponse):
    """A response from which the next tick can start.

    Args:
        iterate: Surface and tangents at the end of the tick.
    """

    iterate: Iterate[FilledState]


class RubberBalloon:
    """The nonlinear balloon, as a `Body`.

    Args:
        settings: As for the linear balloon.
        damping: B_o / K_o at the simulation period of the server.

    Attributes:
        mesh: The inflated surface.
        contact_radius: Radius of the pressure under a contact [m].
        volume: Volume of the water [m^3].

    Raises:
        BodyError: The base fixes too little, or the balloon is not stable.
    """

    name = "balloon"

    def __init__(self, settings: BalloonSettings | None = None, *, damping: float = 0.0) -> None:
        check_damping(damping)
        self.settings = settings or BalloonSettings()
        self.damping = damping
        inflated = inflate(self.settings)
        x, faces = inflated.x, inflated.faces
        self.mesh = SurfaceMesh(x, faces)
        self.contact_radius = self.settings.contact_radius
        free = ~fixed_by_base(inflated, self.settings)
        number: Ints = np.where(free, np.cumsum(free) - 1, -1)
        unstretched, _ = icosphere(self.settings.subdivisions, self.settings.radius)
        membrane = Membrane.at_rest(unstretched / self.settings.stretch, faces, self.settings.mu_h)
        self.volume = volume(x, faces)
        order = number[order_from_base(faces, free)]
        for share in _CAPS:
            cap = order[-max(1, round(share * len(order))) :]
            analysis = analyse(number[faces], x[free], root=cap)
            sheet = RubberSheet(membrane, number, analysis)
            filled = FilledSheet(sheet, dofs(np.flatnonzero(free)[analysis.order]), self.volume)
            self._newton = NewtonIteration(filled)
            rest = self._newton.at_rest(filled.at(x, inflated.pressure))
            if rest is not None:
                self._rest = rest
                return
        raise BodyError("the held balloon is not stable: its stiffness is indefinite")

    def respond(self, loads: Sequence[Load], before: Response | None = None) -> RubberResponse:
        """Iterate towards equilibrium with `loads`, from the state of `before` or from rest."""
        start = before.iterate if isinstance(before, RubberResponse) else self._rest
        shares = np.zeros((len(loads), *self.mesh.vertices.shape))
        for i, load in enumerate(loads):
            shares[i, load.vertices] = load.weights[:, None] * load.direction
        external = np.tensordot(np.array([load.force for load in loads]), shares, axes=1)
        if self.damping:
            external = lagged(external, start.state.internal_force, self.damping)
        moved = self._newton.advance(start, external, shares, self._rest)
        iterate, fields = moved.iterate, moved.fields
        C = np.tensordot(shares, fields, axes=([1, 2], [1, 2]))
        return RubberResponse(
            iterate.state.x - self.mesh.vertices,
            fields,
            0.5 * (C + C.T),
            iterate.state.energy - self._rest.state.energy,
            loads,
            iterate,
        )
