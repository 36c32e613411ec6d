"""Kelvin-Voigt damping, B_o in proportion to K_o, for any elastic body.

What the body carries follows the loads with a lag,

    carried+ = (loads + b carried) / (1 + b),    b = B_o / K_o = relaxation time / simulation period

which for a linear body is eq. (9), (K_o + B_o) x+ = f + B_o x, and for another damps each state of
strain by its own stiffness. What is told of the compliance stays that of the steady state: a law
that counted on K_o + B_o, the stiffness within the tick, would be unstable under delay from
B_o = K_o on (science 3.3: a C below half of the true one).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cohaptic_server.bodies.body import Body, Load, Prefetching, Response
from cohaptic_server.bodies.damping import check_damping
from cohaptic_server.bodies.touched_body import vertex_compliance
from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.numeric import Floats, Ints

_FORGOTTEN = 1e-3  # of the force that a load had; less of it is not carried on


@dataclass(frozen=True, slots=True)
class Carried:
    """A load of some time, as far as it is still carried.

    Args:
        load: With the force that is carried of it.
        most: The greatest force that was [N].
    """

    load: Load
    most: float


@dataclass(frozen=True, eq=False)
class ViscousResponse:
    """A response to present loads and what is left of those before.

    Args:
        elastic: Of the elastic body, to what is carried; the present loads come first.
        count: How many are present.
        carried: All of them.
    """

    elastic: Response
    count: int
    carried: Sequence[Carried]

    @property
    def compliance(self) -> Floats:
        """Between present contacts, shape (c, c) [m/N]."""
        return np.asarray(self.elastic.compliance[: self.count, : self.count])

    @property
    def energy(self) -> float:
        """Stored [J]."""
        return self.elastic.energy

    @property
    def displacement(self) -> Floats:
        """Of every vertex, shape (n, 3) [m]."""
        return self.elastic.displacement

    def at(self, vertices: Ints) -> Floats:
        """Displacement of some vertices, shape (k, 3) [m]."""
        return self.elastic.at(vertices)

    def without(self, loads: slice, forces: Floats, vertices: Ints) -> Floats:
        """Displacement of some vertices without some of the present loads, shape (k, 3) [m]."""
        return self.elastic.without(loads, forces, vertices)


class Viscous:
    """A linear elastic body with damping, behind the `Body` Protocol.

    The lag is one of loads, so that the elastic body may answer for a few vertices alone.

    Args:
        elastic: A body to which two loads do what each of them does, added.
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

    def respond(self, loads: Sequence[Load], before: Response | None = None) -> ViscousResponse:
        """Part of the way from where `before` left it to where `loads` would bring it."""
        b, left = self.damping, list[Carried]()
        was: Response | None = None
        if isinstance(before, ViscousResponse):
            left, was = list(before.carried), before.elastic
        carried: list[Carried] = []
        for load in loads:
            force = load.force
            for other in left:
                # A hand that holds still adds to what it did before.
                if _alike(load, other.load):
                    force += b * other.load.force
                    left.remove(other)
                    break
            force /= 1.0 + b
            carried.append(Carried(replace(load, force=force), abs(force)))
        for other in left:
            force = other.load.force * b / (1.0 + b)
            if abs(force) > _FORGOTTEN * other.most:
                carried.append(Carried(replace(other.load, force=force), other.most))
        response = self.elastic.respond([one.load for one in carried], was)
        return ViscousResponse(response, len(loads), carried)

    def prefetch(self, vertices: Ints) -> None:
        """Say which vertices lie ahead of fingers that slide, shape (k,)."""
        if isinstance(self.elastic, Prefetching):
            self.elastic.prefetch(vertices)

    def vertex_compliance(self) -> Floats:
        """C_ii of a contact centred at each vertex, along its normal, shape (n,) [m/N]."""
        return vertex_compliance(self.elastic)


def _alike(one: Load, other: Load) -> bool:
    return (
        np.array_equal(one.vertices, other.vertices)
        and np.array_equal(one.weights, other.weights)
        and np.array_equal(one.direction, other.direction)
    )
