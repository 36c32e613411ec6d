"""A solid of rubber or tissue under large deformation: any object, held in some region.

The nonlinear twin of `solid.py`, on the same mesh with the same small-strain moduli
(`neo_hookean.py`), solved in each tick (`settling.py`) under the contacts' forces as dead loads,
which keep their directions while the surface moves. `fields` and `compliance` are those of the
tangent at the present state (science 3.6). While the body is in motion it may be a chord behind.

With a damping B_o the body is Kelvin-Voigt as in eq. (9): `viscous.py`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cohaptic.errors import BodyError
from cohaptic_server.bodies.body import DenseResponse, Load, Response
from cohaptic_server.bodies.damping import check_damping, lagged
from cohaptic_server.bodies.newton import CHORD, MAX_MOVE, Pace, Settled, Settling
from cohaptic_server.bodies.rubber_solid.neo_hookean import NeoHookean
from cohaptic_server.bodies.rubber_solid.rubber_tetrahedra import RubberTetrahedra, SolidState
from cohaptic_server.bodies.solid.shape import SolidSettings, shape_of
from cohaptic_server.mesh.pressure import pressure
from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.mesh.tetrahedra import TetMesh
from cohaptic_server.numeric import Floats

# One factorisation in a tick of a hand in motion: it is most of what a tick costs.
_STEPS = 1
_CHORD = 0.002  # of the body's size, where that is less than a balloon's
_MOVE = 0.2
_BATCH = 32  # contacts solved for at once
# A tick of two hands that slide takes so long, at the 99th percentile (docs/decisions/0015).
_MEASURED_NODES, _MEASURED_TICK, _GROWTH = 600, 0.016, 1.35


def tick_seconds(nodes: int) -> float:
    """What a tick of a solid of so many nodes takes, about, on the machine it was measured on."""
    return float(_MEASURED_TICK * (nodes / _MEASURED_NODES) ** _GROWTH)


@dataclass(frozen=True, eq=False)
class RubberSolidResponse(DenseResponse):
    """A response that the next tick can start from.

    Args:
        settled: Where the solid came to, and its tangents.
    """

    settled: Settled[SolidState]


class RubberSolid:
    """The nonlinear solid behind the `Body` Protocol.

    Args:
        tets: The object at rest.
        held: Which of its vertices do not move, shape (n,) of bool.
        settings: What it is made of; no columns are cached.
        name: For people and for the wire.
        damping: B_o over K_o, for the simulation period that it is served with.

    Attributes:
        shape: Nodes, elements and surface.
        rubber: Energy, forces and tangent.

    Raises:
        BodyError: Nothing is held, too little, or everything.
    """

    def __init__(
        self,
        tets: TetMesh,
        held: npt.NDArray[np.bool_],
        settings: SolidSettings | None = None,
        name: str = "solid",
        *,
        damping: float = 0.0,
    ) -> None:
        check_damping(damping)
        self.settings, self.damping, self._name = settings or SolidSettings(), damping, name
        self.shape = shape_of(tets, held, self.settings)
        material = NeoHookean.of(self.settings.young, self.settings.nu)
        self.rubber = RubberTetrahedra(self.shape, material)
        size = self.mesh.size
        pace = Pace(_STEPS, min(MAX_MOVE, _MOVE * size), min(CHORD, _CHORD * size))
        self._settling = Settling(self.rubber, pace)
        state = self.rubber.at(self.shape.nodes)
        rest = None if state is None else self._settling.at_rest(state)
        if rest is None:
            raise BodyError("the solid is not stable at rest: are its tetrahedra nearly flat?")
        self._rest = rest

    @property
    def name(self) -> str:
        """Name for people and for the wire."""
        return self._name

    @property
    def mesh(self) -> SurfaceMesh:
        """The resting surface."""
        return self.shape.mesh

    @property
    def contact_radius(self) -> float:
        """Radius of the pressure under a contact [m]."""
        return self.shape.contact_radius

    def respond(self, loads: Sequence[Load], before: Response | None = None) -> RubberSolidResponse:
        """Go towards equilibrium with `loads`, from where `before` was left."""
        start = before.settled if isinstance(before, RubberSolidResponse) else self._rest
        surface = self.shape.surface
        shares = np.zeros((len(loads), *self.shape.nodes.shape))
        for i, load in enumerate(loads):
            shares[i, surface[load.vertices]] = load.weights[:, None] * load.direction
        push = np.tensordot(np.array([load.force for load in loads]), shares, axes=1)
        if self.damping:
            push = lagged(push, start.state.force, self.damping)
        settled = self._settling.settle(start, push)
        fields = self._settling.fields(settled.stable, shares)
        C = np.tensordot(shares, fields, axes=([1, 2], [1, 2]))
        return RubberSolidResponse(
            settled.state.x[surface] - self.mesh.vertices,
            fields[:, surface],
            0.5 * (C + C.T),
            settled.state.energy - self._rest.state.energy,
            settled,
        )

    def vertex_compliance(self) -> Floats:
        """C_ii of a contact centred at each vertex of the body at rest, shape (n,) [m/N]."""
        mesh, surface = self.mesh, self.shape.surface
        table: Floats = np.empty(len(surface))
        for start in range(0, len(surface), _BATCH):
            some = range(start, min(start + _BATCH, len(surface)))
            shares = np.zeros((len(some), *self.shape.nodes.shape))
            for i, k in enumerate(some):
                vertices, weights = pressure(mesh, mesh.vertices[k], self.contact_radius)
                shares[i, surface[vertices]] = -weights[:, None] * mesh.normals[k]
            fields = self._settling.fields(self._rest.stable, shares)
            table[some.start : some.stop] = (shares * fields).sum(axis=(1, 2))
        return np.maximum(0.0, table)
