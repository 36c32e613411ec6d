"""A solid of rubber or tissue under large deformation: any object, fixed in some region.

This is the nonlinear counterpart of `solid.py`, on the same mesh with the same small-strain moduli
(`hyperelastic.py`). Each tick iterates (`newton.py`) under the contacts' forces as dead loads,
which keep their directions while the surface moves. `fields` and `compliance` are those of the
tangent at the present state (science 3.6); while the body moves, the tangent may be that of
positions up to `TickLimits.chord` away.

With a damping B_o the body is Kelvin-Voigt as in eq. (9): `viscous.py`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from cohaptic.errors import BodyError
from cohaptic_server.bodies.body import Load, Response
from cohaptic_server.bodies.hyperelastic import NeoHookean
from cohaptic_server.bodies.newton import (
    CHORD,
    MAX_MOVE,
    FiniteResponse,
    Iterate,
    NewtonIteration,
    TickLimits,
)
from cohaptic_server.bodies.rubber_solid.rubber_tetrahedra import RubberTetrahedra, SolidState
from cohaptic_server.bodies.solid.shape import Moduli, SolidSettings, shape_of
from cohaptic_server.bodies.viscous import check_damping, lagged
from cohaptic_server.mesh.surface import pressure
from cohaptic_server.mesh.tetrahedra import TetMesh
from cohaptic_server.numeric import Floats, Mask
from cohaptic_server.side_by_side import cores

# One step, with one factorisation, in a tick: the factorisation is most of the cost of a tick.
_STEPS = 1
_CHORD = 0.002  # share of the body's size; limits the chord if below `newton.CHORD`
_MOVE = 0.2  # share of the body's size; limits the motion if below `newton.MAX_MOVE`
_BATCH = 32  # contacts in one solve
# Numbers of nodes, on one core and on more, at which a tick of two sliding hands takes the measured
# time (99th percentile, compiled loops) [s], and the exponent of the time in the number of nodes
# (docs/design/rubber.md).
_NODES_ON_ONE_CORE, _NODES_ON_TWO, _MEASURED_TICK, _GROWTH = 1300, 1500, 0.016, 1.35


def tick_seconds(nodes: int) -> float:
    """Return the estimated time of a tick for a number of nodes, from docs/design/rubber.md [s]."""
    measured = _NODES_ON_TWO if cores() > 1 else _NODES_ON_ONE_CORE
    return float(_MEASURED_TICK * (nodes / measured) ** _GROWTH)


@dataclass(frozen=True, eq=False)
class RubberSolidResponse(FiniteResponse):
    """The response of the rubber solid, with the state from which the next tick starts.

    Args:
        iterate: Solid and tangents at the end of the tick.
    """

    iterate: Iterate[SolidState]


class RubberSolid:
    """The nonlinear solid, as a `Body`.

    Args:
        tets: The object at rest.
        fixed: Vertices that do not move, shape (n,).
        settings: Material, elements and contact radius; `cache` has no effect.
        name: Name of the body, shown to users and sent over the network.
        damping: Ratio B_o / K_o of damping to stiffness at the simulation period of the server.
        table: Result of `vertex_compliance` for the same solid; None computes it when needed.
        moduli: Elastic moduli of each tetrahedron, at small strains; None takes the material of the
            settings for all of them.

    Attributes:
        name: As given.
        mesh: The resting surface.
        contact_radius: Radius of the pressure under a contact [m].
        shape: Nodes, elements and surface.
        rubber: Energy, forces and tangent.
        linear: False.

    Raises:
        BodyError: No vertices are fixed, too few, or all; or the solid is not stable at rest.
    """

    linear = False

    def __init__(
        self,
        tets: TetMesh,
        fixed: Mask,
        settings: SolidSettings | None = None,
        name: str = "solid",
        *,
        damping: float = 0.0,
        table: Floats | None = None,
        moduli: Moduli | None = None,
    ) -> None:
        check_damping(damping)
        self.settings, self.damping, self.name = settings or SolidSettings(), damping, name
        self.shape = shape_of(tets, fixed, self.settings, moduli)
        self.mesh, self.contact_radius = self.shape.mesh, self.shape.contact_radius
        self.rubber = RubberTetrahedra(self.shape, NeoHookean.of(self.shape.moduli))
        size = self.mesh.size
        limits = TickLimits(_STEPS, min(MAX_MOVE, _MOVE * size), min(CHORD, _CHORD * size))
        self._newton = NewtonIteration(self.rubber, limits)
        state = self.rubber.state(self.shape.nodes)
        rest = None if state is None else self._newton.at_rest(state)
        if rest is None:
            raise BodyError("the solid is not stable at rest: are its tetrahedra nearly flat?")
        self._rest = rest
        self._table = table

    def respond(self, loads: Sequence[Load], before: Response | None = None) -> RubberSolidResponse:
        """Return the response after a Newton step towards equilibrium with `loads`.

        Args:
            loads: Loads of the present contacts.
            before: Response of the previous tick, where the step starts; None starts from rest.
        """
        start = before.iterate if isinstance(before, RubberSolidResponse) else self._rest
        surface = self.shape.surface
        fractions = np.zeros((len(loads), *self.shape.nodes.shape))
        for i, load in enumerate(loads):
            fractions[i, surface[load.vertices]] = load.weights[:, None] * load.direction
        external = np.tensordot(np.array([load.force for load in loads]), fractions, axes=1)
        if self.damping:
            external = lagged(external, start.state.internal_force, self.damping)
        moved = self._newton.advance(start, external, fractions, self._rest)
        iterate, fields = moved.iterate, moved.fields
        C = np.tensordot(fractions, fields, axes=([1, 2], [1, 2]))
        return RubberSolidResponse(
            iterate.state.x[surface] - self.mesh.vertices,
            fields[:, surface],
            0.5 * (C + C.T),
            iterate.state.energy - self._rest.state.energy,
            loads,
            iterate,
        )

    def vertex_compliance(self, progress: Callable[[float], None] | None = None) -> Floats:
        """Return the compliance of a contact at each vertex along its normal, for the resting body.

        Args:
            progress: Receives the completed share, up to 1; not called if the table exists.

        Returns:
            Compliance C_ii of a contact centred at each vertex, shape (n,) [m/N].
        """
        if self._table is None:
            self._table = self._pressed(progress or (lambda fraction: None))
        return self._table

    def _pressed(self, progress: Callable[[float], None]) -> Floats:
        mesh, surface = self.mesh, self.shape.surface
        table: Floats = np.empty(len(surface))
        for start in range(0, len(surface), _BATCH):
            batch = range(start, min(start + _BATCH, len(surface)))
            fractions = np.zeros((len(batch), *self.shape.nodes.shape))
            for i, k in enumerate(batch):
                vertices, weights = pressure(
                    mesh, mesh.vertices[k], self.contact_radius, mesh.normals[k]
                )
                fractions[i, surface[vertices]] = -weights[:, None] * mesh.normals[k]
            # The tangent is positive definite, and fixed nodes do not move: C_ii is not negative.
            fields = self._newton.fields(self._rest.stable, fractions)
            table[batch.start : batch.stop] = (fractions * fields).sum(axis=(1, 2))
            progress(batch.stop / len(surface))
        table.setflags(write=False)
        return table
