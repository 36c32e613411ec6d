"""The water balloon under finite deformation: rubber that wrinkles, water of constant volume.

The nonlinear twin of `balloon.py`: the same inflated balloon, but energy, forces and volume at the
present positions (`sheet.py`), solved in each tick (`settling.py`) under the contacts' forces as
dead loads, which keep their directions while the surface moves. `fields` and `compliance` are those
of the tangent at the present state (science 3.6). While the surface is in motion it may be
`settling.CHORD` behind.

With a damping B_o the body is Kelvin-Voigt as in eq. (9), with B_o in proportion to K_o. What the
rubber carries then follows the loads with a lag,

    carried+ = (loads + b carried) / (1 + b),    b = B_o / K_o = relaxation time / simulation period

which for a linear body is (K_o + B_o) x+ = f + B_o x, and for this one damps each state of
strain by its own stiffness. What is told of the compliance stays that of the steady state: a law
that counted on K_o + B_o, the stiffness within the tick, would be unstable under delay from
B_o = K_o on (science 3.3: a C below half of the true one).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cohaptic.errors import BodyError
from cohaptic_server.bodies.balloon.balloon import BalloonSettings, held_by_base, inflate
from cohaptic_server.bodies.balloon.constant_volume_solver import Band, order
from cohaptic_server.bodies.balloon.filled_sheet import WateredSheet, WateredState
from cohaptic_server.bodies.balloon.membrane import Membrane
from cohaptic_server.bodies.balloon.rubber_sheet import Sheet
from cohaptic_server.bodies.body import DenseResponse, Load, Response
from cohaptic_server.bodies.damping import check_damping, lagged
from cohaptic_server.bodies.newton import Settled, Settling
from cohaptic_server.mesh.enclosed_volume import volume
from cohaptic_server.mesh.icosphere import icosphere
from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.numeric import Ints

# Far past its pressure maximum a balloon needs a larger cap held to have no negative mode but the
# water's; each costs more, so the smallest that does is taken.
_CAPS = (0.14, 0.3, 0.5)


@dataclass(frozen=True, eq=False)
class RubberResponse(DenseResponse):
    """A response that the next tick can start from.

    Args:
        settled: Where the surface came to, and its tangents.
    """

    settled: Settled[WateredState]


class RubberBalloon:
    """The nonlinear balloon behind the `Body` Protocol.

    Args:
        settings: As of the linear balloon.
        damping: B_o over K_o, for the simulation period that it is served with.
    """

    name = "balloon"

    def __init__(self, settings: BalloonSettings | None = None, *, damping: float = 0.0) -> None:
        check_damping(damping)
        self.settings = settings or BalloonSettings()
        self.damping = damping
        inflated = inflate(self.settings)
        x, faces = inflated.x, inflated.faces
        self._mesh = SurfaceMesh(x, faces)
        found = order(faces, ~held_by_base(inflated, self.settings))
        dof = (3 * found[:, None] + np.arange(3)).ravel()
        number: Ints = np.full(x.size, -1, dtype=np.int64)
        number[dof] = np.arange(dof.size)
        rest, _ = icosphere(self.settings.subdivisions, self.settings.radius)
        membrane = Membrane.at_rest(rest / self.settings.stretch, faces, self.settings.mu_h)
        sheet = Sheet(membrane, len(x), number)
        self.volume = volume(x, faces)
        for share in _CAPS:
            band = Band(sheet.rows, sheet.columns, dof.size, share)
            watered = WateredSheet(sheet, dof, band, self.volume)
            self._settling = Settling(watered)
            found_rest = self._settling.at_rest(watered.at(x, inflated.pressure))
            if found_rest is not None:
                self._rest = found_rest
                return
        raise BodyError("the held balloon is not stable: its stiffness is indefinite")

    @property
    def mesh(self) -> SurfaceMesh:
        """The inflated surface."""
        return self._mesh

    @property
    def contact_radius(self) -> float:
        """Radius of the pressure under a contact [m]."""
        return self.settings.contact_radius

    def respond(self, loads: Sequence[Load], before: Response | None = None) -> RubberResponse:
        """Go towards equilibrium with `loads`, from where `before` was left."""
        start = before.settled if isinstance(before, RubberResponse) else self._rest
        shares = np.zeros((len(loads), *self._mesh.vertices.shape))
        for i, load in enumerate(loads):
            shares[i, load.vertices] = load.weights[:, None] * load.direction
        push = np.tensordot(np.array([load.force for load in loads]), shares, axes=1)
        if self.damping:
            push = lagged(push, start.state.carried, self.damping)
        settled = self._settling.settle(start, push)
        fields = self._settling.fields(settled.stable, shares)
        C = np.tensordot(shares, fields, axes=([1, 2], [1, 2]))
        return RubberResponse(
            settled.state.x - self._mesh.vertices,
            fields,
            0.5 * (C + C.T),
            settled.state.energy - self._rest.state.energy,
            settled,
        )
