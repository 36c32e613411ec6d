"""The water balloon under finite deformation: its rubber wrinkles, its water keeps the volume.

This is the nonlinear counterpart of `balloon.py`: the same inflated balloon, but with energy,
forces and volume at the present positions. Each tick iterates (`newton.py`) under the contacts'
forces as dead loads, which keep their directions while the surface moves. `fields` and `compliance`
are those of the tangent at the present state (science 3.6); while the surface moves, the tangent
may be that of positions up to `newton.CHORD` away. With a damping B_o the body is Kelvin-Voigt as
in eq. (9), with B_o in proportion to the stiffness K_o (`viscous.py`): the internal force follows
the external one with a lag.

`RubberSheet` gives the energy, the forces and the tangent of a closed rubber sheet round water at
any deformation.

`ConstantVolumeFactor` solves  [K g; g' 0] [u; q] = [b; 0]  for the displacement u under forces b
and for a multiplier q, with a tangent K at constant volume (g = dV/dx). K may have one negative
mode, which constant volume forbids. The factorisation therefore begins with all unknowns outside of
a cap of vertices (the root of the tree of fronts): K must be positive definite with the cap fixed.
Next comes the row of the volume, whose pivot is negative, and then the cap, which must be positive
definite again. This succeeds only if K is positive definite on all motions that keep the volume: a
tangent that can be factored is stable. The choice of the cap decides up to which deformation K with
the cap fixed stays positive definite: the last vertices in an order of narrow band serve better
than the vertices on the top, or than a belt.

The Newton iteration moves the sheet round a constant volume of water. In the space of vertex
positions, a step is tangent to the manifold of constant volume and is then projected onto this
manifold. The pressure is the least-squares balance of rubber and loads: unlike the sum of Newton's
corrections, it does not drift when a tangent is close to singular.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.linalg import lapack
from scipy.sparse import csgraph

from cohaptic.errors import BodyError
from cohaptic_server.bodies.balloon.balloon import BalloonSettings, fixed_by_base, inflate
from cohaptic_server.bodies.balloon.membrane import Membrane
from cohaptic_server.bodies.balloon.tension_field import (
    add_forces,
    add_pressure,
    add_tangents,
    add_volume_gradient,
    energy,
    strains,
)
from cohaptic_server.bodies.body import Load, Response
from cohaptic_server.bodies.hyperelastic import IndefiniteTangentError
from cohaptic_server.bodies.newton import FiniteResponse, Iterate, NewtonIteration
from cohaptic_server.bodies.viscous import check_damping, lagged
from cohaptic_server.cholesky.refactor import Indefinite, Refactored, Workspace
from cohaptic_server.cholesky.symbolic import Analysis, analyse, dofs
from cohaptic_server.mesh.enclosed_volume import volume
from cohaptic_server.mesh.icosphere import icosphere
from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.numeric import Floats, Ints, Mask


class RubberSheet:
    """Energy, forces and tangent of a closed rubber sheet round water.

    Args:
        membrane: The unstretched sheet.
        number: Index of each vertex among the free vertices, negative if fixed, shape (n,).
        analysis: Pattern of the tangent on the free vertices, and the order of the unknowns.

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
        """Return the strain of each triangle as in `tension_field.py`, shape (m, 10).

        Args:
            x: Positions of the vertices, shape (n, 3) [m].
        """
        out = np.empty((len(self.faces), 10))
        strains(np.ascontiguousarray(x), self.faces, self._gradients, out)
        return out

    def energy(self, strain: Floats) -> float:
        """Return the strain energy of the rubber [J]."""
        return energy(strain, self._area) * self._mu_h

    def force(self, strain: Floats) -> Floats:
        """Return the nodal forces that hold the rubber in this strain, dE/dx, shape (n, 3) [N]."""
        out = np.zeros((self._size, 3))
        add_forces(strain, self.faces, self._gradients, self._stiffness, out)
        return out

    def volume_gradient(self, x: Floats) -> Floats:
        """Return dV/dx, shape (n, 3) [m^2]; the volume is V = (dV/dx . x) / 3 (Euler's theorem)."""
        out = np.zeros((self._size, 3))
        add_volume_gradient(np.ascontiguousarray(x), self.faces, out)
        return out

    def tangent(self, strain: Floats, x: Floats, pressure: float) -> Floats:
        """Return the blocks of d2E/dx2 - p d2V/dx2 in the order of the analysis, (e, 9) [N/m].

        Args:
            strain: Strain of each triangle at `x`, shape (m, 10).
            x: Positions of the vertices, shape (n, 3) [m].
            pressure: Pressure p of the water [Pa].
        """
        count = len(self.analysis.rows)
        blocks, scratch = np.zeros((count, 9)), np.empty(6)
        add_tangents(strain, self._gradients, self._stiffness, self._index, count, scratch, blocks)
        add_pressure(np.ascontiguousarray(x), self.faces, pressure, self._index, count, blocks)
        return blocks


def order_from_base(faces: Ints, free: Mask) -> Ints:
    """Return the free vertices in an order of narrow band that begins at the base.

    The order is that of reverse Cuthill and McKee.

    Args:
        faces: Vertices of each triangle, shape (m, 3).
        free: Vertices that can move, shape (n,).

    Returns:
        Indices of the free vertices, shape (f,).
    """
    n = len(free)
    pairs = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    graph = sp.csr_array((np.ones(len(pairs)), pairs.T), shape=(n, n))
    graph = sp.csr_array(graph + graph.T)[free][:, free]
    order = np.asarray(
        csgraph.reverse_cuthill_mckee(sp.csr_matrix(graph), symmetric_mode=True), dtype=np.int64
    )
    beside = np.isin(np.flatnonzero(free), faces[~free[faces].all(axis=1)])
    if np.flatnonzero(beside[order]).mean() > 0.5 * len(order):
        order = order[::-1]
    return np.asarray(np.flatnonzero(free)[order], dtype=np.int64)


class ConstantVolumeFactor:
    """A factored tangent K at constant volume, as a `TangentSolver`.

    Args:
        workspace: Memory for matrices of K's pattern, with the cap as the root front.
        blocks: Blocks of K in the order of the pattern, shape (e, 9) [N/m].
        g: dV/dx of the unknowns in the order of elimination, shape (size,) [m^2].

    Raises:
        IndefiniteTangentError: K is not positive definite at constant volume.
    """

    def __init__(self, workspace: Workspace, blocks: Floats, g: Floats) -> None:
        try:
            self._factor = Refactored(workspace, blocks, without_root=True)
        except Indefinite as error:
            raise IndefiniteTangentError(
                "the tangent is indefinite even with its cap held"
            ) from error
        self._root = 3 * workspace.analysis.fronts[-1].first
        y = self._factor.forward(g[:, None])
        self._y, self._h = y[: self._root], y[self._root :, 0]
        self._c = float(self._y[:, 0] @ self._y[:, 0])
        S = self._factor.root + np.outer(self._h, self._h) / self._c
        self._R, failed = lapack.dpotrf(S, lower=1)
        if failed:
            raise IndefiniteTangentError("the tangent is indefinite")

    def solve(self, b: Floats) -> tuple[Floats, Floats]:
        """Solve for displacements u and volume multipliers q under forces on the unknowns.

        Args:
            b: Forces in c load cases, shape (c, size) [N].

        Returns:
            Displacements, shape (c, size) [m], and multipliers, shape (c,) [Pa].
        """
        x = np.asarray(self._factor.forward(b.T), dtype=np.float64)
        inner, last = x[: self._root], x[self._root :]
        along = self._y[:, 0] @ inner
        rest = last - np.outer(self._h, along / self._c)
        last[:] = lapack.dpotrs(self._R, rest, lower=1)[0]
        q = (along + self._h @ last) / self._c
        inner -= self._y * q
        self._factor.backward(x)
        return np.ascontiguousarray(x.T), np.asarray(q)

    def displacements(self, b: Floats) -> Floats:
        """Solve for the displacements of the unknowns under forces on them.

        Args:
            b: Forces in c load cases, shape (c, size) [N].

        Returns:
            Displacements, shape (c, size) [m].
        """
        return self.solve(b)[0]

    def step(self, b: Floats) -> Floats:
        """Solve as `displacements` does: an approximation would not be quicker to compute."""
        return self.displacements(b)


@dataclass(frozen=True, eq=False)
class FilledState:
    """A deformed balloon, not necessarily in equilibrium.

    Args:
        x: Positions of the vertices, shape (n, 3) [m].
        strain: Strain of the rubber, as in `tension_field.py`, shape (m, 10).
        energy: Energy of the rubber [J].
        rubber_force: Nodal forces that hold the rubber in this shape, dE/dx, shape (n, 3) [N].
        g: Gradient dV/dx of the volume, shape (n, 3) [m^2].
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
    """A rubber sheet that is fixed to a base and filled with water, as a `Hyperelastic` body.

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

    def state(self, x: Floats, pressure: float) -> FilledState:
        """Return the state at some vertex positions and a known pressure.

        Args:
            x: Positions of the vertices, shape (n, 3) [m].
            pressure: Pressure of the water [Pa].
        """
        strain = self._sheet.strain(x)
        g = self._sheet.volume_gradient(x)
        return FilledState(
            x, strain, self._sheet.energy(strain), self._sheet.force(strain), g, pressure
        )

    def displaced(self, state: FilledState, step: Floats, external: Floats) -> FilledState | None:
        """Return the state after a step, projected onto the water's volume; None if that fails.

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
        """Return the external forces less the forces of rubber and water, shape (n, 3) [N]."""
        return np.asarray(external - state.internal_force)

    def factor_tangent(
        self, state: FilledState, stiffening: float, b: Floats
    ) -> tuple[ConstantVolumeFactor, Floats]:
        """Factor the tangent, with its diagonal raised by `stiffening` times the mean diagonal.

        Args:
            state: The deformed balloon.
            stiffening: Added share of the mean diagonal; 0 for the exact tangent.
            b: Forces on the unknowns, shape (c, size) [N].

        Returns:
            The factor, and the displacements of the unknowns under `b`, shape (c, size) [m].
        """
        blocks = self._sheet.tangent(state.strain, state.x, state.pressure)
        if stiffening:
            # The first block of each column is the one on the diagonal.
            diagonal = self._sheet.analysis.starts[:-1, None], np.array([[0, 4, 8]])
            blocks[diagonal] += stiffening * float(blocks[diagonal].mean())
        along = state.g.reshape(-1)[self.dof]
        factor = ConstantVolumeFactor(self._workspace, blocks, along)
        return factor, factor.displacements(b)

    def _balanced(self, x: Floats, g: Floats, external: Floats) -> FilledState:
        """Return the state at `x` with the pressure that best balances rubber and loads."""
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
    """The response of the rubber balloon, with the state from which the next tick starts.

    Args:
        iterate: Surface and tangents at the end of the tick.
    """

    iterate: Iterate[FilledState]


class RubberBalloon:
    """The nonlinear balloon, as a `Body`.

    Args:
        settings: As for the linear balloon.
        damping: Ratio B_o / K_o of damping to stiffness at the simulation period of the server.

    Attributes:
        mesh: The inflated surface.
        contact_radius: Radius of the pressure under a contact [m].
        volume: Volume of the water [m^3].
        linear: False.

    Raises:
        BodyError: The base fixes too little, or the balloon is not stable.
    """

    name = "balloon"
    linear = False

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
        for fraction in _CAPS:
            cap = order[-max(1, round(fraction * len(order))) :]
            analysis = analyse(number[faces], x[free], root=cap)
            sheet = RubberSheet(membrane, number, analysis)
            filled = FilledSheet(sheet, dofs(np.flatnonzero(free)[analysis.order]), self.volume)
            self._newton = NewtonIteration(filled)
            rest = self._newton.at_rest(filled.state(x, inflated.pressure))
            if rest is not None:
                self._rest = rest
                return
        raise BodyError("the held balloon is not stable: its stiffness is indefinite")

    def respond(self, loads: Sequence[Load], before: Response | None = None) -> RubberResponse:
        """Return the response after a few Newton steps towards equilibrium with `loads`.

        Args:
            loads: Loads of the present contacts.
            before: Response of the previous tick, where the steps start; None starts from rest.
        """
        start = before.iterate if isinstance(before, RubberResponse) else self._rest
        fractions = np.zeros((len(loads), *self.mesh.vertices.shape))
        for i, load in enumerate(loads):
            fractions[i, load.vertices] = load.weights[:, None] * load.direction
        external = np.tensordot(np.array([load.force for load in loads]), fractions, axes=1)
        if self.damping:
            external = lagged(external, start.state.internal_force, self.damping)
        moved = self._newton.advance(start, external, fractions, self._rest)
        iterate, fields = moved.iterate, moved.fields
        C = np.tensordot(fractions, fields, axes=([1, 2], [1, 2]))
        return RubberResponse(
            iterate.state.x - self.mesh.vertices,
            fields,
            0.5 * (C + C.T),
            iterate.state.energy - self._rest.state.energy,
            loads,
            iterate,
        )
