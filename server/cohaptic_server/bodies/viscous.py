"""Kelvin-Voigt damping of any linear elastic body, B_o in proportion to K_o.

What the body carries follows the loads with a lag,

    carried+ = (loads + b carried) / (1 + b),    b = B_o / K_o = relaxation time / simulation period

which for a linear body is eq. (9), (K_o + B_o) x+ = f + B_o x. `fields` and C stay those of the
steady state: a law that counted on K_o + B_o, the stiffness within the tick, would be unstable
under delay from B_o = K_o on (science 3.3: a C below half of the true one).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cohaptic_server.bodies.balloon import check_damping
from cohaptic_server.bodies.body import Body, Load, Response
from cohaptic_server.bodies.mesh import Floats, SurfaceMesh
from cohaptic_server.neighbourhood import vertex_compliance


def lagged(loads: Floats, carried: Floats, damping: float) -> Floats:
    """What a viscous body carries in this tick, of loads and what it carried before, any shape."""
    return np.asarray((loads + damping * carried) / (1.0 + damping))


class Viscous:
    """A linear elastic body with damping, behind the `Body` Protocol.

    Args:
        elastic: A body whose displacement is C times the forces.
        damping: B_o over K_o, for the simulation period that it is served with.
    """

    def __init__(self, elastic: Body, damping: float) -> None:
        check_damping(damping)
        self.elastic, self.damping = elastic, damping

    @property
    def name(self) -> str:
        """Name for people and for the wire."""
        return self.elastic.name

    @property
    def mesh(self) -> SurfaceMesh:
        """The resting surface."""
        return self.elastic.mesh

    @property
    def contact_radius(self) -> float:
        """Radius of the pressure under a contact [m]."""
        return self.elastic.contact_radius

    def respond(self, loads: Sequence[Load], before: Response | None = None) -> Response:
        """Part of the way from where `before` left it to where `loads` would bring it."""
        end, b = self.elastic.respond(loads), self.damping
        if before is None:
            was, stored = np.zeros_like(end.displacement), 0.0
        else:
            was, stored = before.displacement, before.energy
        # E is a square: E(x_end + b x) has the work of the loads on x between the two.
        work = sum(
            load.force * float(load.weights @ (was[load.vertices] @ load.direction))
            for load in loads
        )
        energy = (end.energy + b * work + b * b * stored) / (1.0 + b) ** 2
        x = lagged(end.displacement, was, b)
        return Response(x, end.fields, end.compliance, energy)

    def vertex_compliance(self) -> Floats:
        """C_ii of a contact centred at each vertex, along its normal, shape (n,) [m/N]."""
        return vertex_compliance(self.elastic)
