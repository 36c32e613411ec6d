"""Kelvin-Voigt damping, B_o in proportion to K_o, for any elastic body.

A body of stiffness K_o and damping B_o consists of an elastic part and a damper in parallel. The
forces that the elastic part carries follow the loads with a lag,

    carried+ = (loads + b carried) / (1 + b),    b = B_o / K_o = relaxation time / simulation period

For a linear body this is eq. (9), (K_o + B_o) x+ = f + B_o x, with the force f and the position x.
In a nonlinear body each state of strain is damped in proportion to its own stiffness. The reported
compliance C is that of the steady state: a control law that relied on K_o + B_o, the stiffness
within one tick, would be unstable under delay for B_o >= K_o (science 3.3: a C below half of the
true one).

Linear and nonlinear bodies share this lag (`lagged`); `Viscous` adds it to a linear body.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cohaptic.errors import SettingError
from cohaptic_server.bodies.body import Body, Load, Prefetching, Response
from cohaptic_server.bodies.touched_body import vertex_compliance
from cohaptic_server.numeric import Floats, Ints


def check_damping(damping: float) -> None:
    """Raise an error for a ratio B_o / K_o outside of 0 to 2.

    With a larger ratio, hands with a delay would oscillate for long.

    Args:
        damping: Ratio of damping to stiffness, the body's relaxation time in ticks.

    Raises:
        SettingError: The ratio is outside of 0 to 2.
    """
    if not 0.0 <= damping <= 2.0:
        raise SettingError("damping B_o / K_o", damping, "from 0 to 2 (relaxation in ticks)")


def lagged(applied: Floats, carried: Floats, damping: float) -> Floats:
    """Return the forces that the elastic part of the body carries at the end of a tick [N].

    Args:
        applied: Forces applied in this tick, any shape [N].
        carried: Forces that the elastic part carried before the tick, of the same shape [N].
        damping: Ratio B_o / K_o of eq. (9).
    """
    return np.asarray((applied + damping * carried) / (1.0 + damping))


_NEGLIGIBLE = 1e-3  # share of `DecayingLoad.peak` below which a decaying load is dropped


@dataclass(frozen=True, slots=True)
class DecayingLoad:
    """A present or past load, with the force of it that the elastic body still carries.

    Args:
        load: The load, with the carried force.
        peak: Magnitude of the carried force when the load was last applied [N].
    """

    load: Load
    peak: float


@dataclass(frozen=True, eq=False)
class ViscousResponse:
    """Response to the present loads and to earlier loads whose forces still decay.

    Args:
        elastic: Response of the elastic body to the carried loads.
        count: Number of present loads.
        carried: The carried loads; the present ones come first.
    """

    elastic: Response
    count: int
    carried: Sequence[DecayingLoad]

    @property
    def compliance(self) -> Floats:
        """Compliance between present contacts, shape (c, c) [m/N]."""
        return np.asarray(self.elastic.compliance[: self.count, : self.count])

    @property
    def energy(self) -> float:
        """Elastic energy stored by the carried loads [J]."""
        return self.elastic.energy

    @property
    def displacement(self) -> Floats:
        """Displacement of every vertex, shape (n, 3) [m]."""
        return self.elastic.displacement

    def displacement_of(self, vertices: Ints) -> Floats:
        """Return the displacement of some vertices, shape (k, 3) [m]."""
        return self.elastic.displacement_of(vertices)

    def without(self, loads: slice, forces: Floats, vertices: Ints) -> Floats:
        """Return the displacement of some vertices without some present loads, shape (k, 3) [m]."""
        return self.elastic.without(loads, forces, vertices)


class Viscous:
    """A linear elastic body with damping, as a `Body`.

    The lag acts on the loads and not on the displacement, so that the elastic body may compute the
    displacement of a few vertices only.

    Args:
        elastic: A linear body: the displacements under several loads add up.
        damping: Ratio B_o / K_o of damping to stiffness at the simulation period of the server.

    Attributes:
        name: Name of the elastic body.
        mesh: The resting surface.
        contact_radius: Radius of the pressure under a contact [m].
        linear: False, because the response depends on earlier loads, too.
    """

    linear = False

    def __init__(self, elastic: Body, damping: float) -> None:
        check_damping(damping)
        self.elastic, self.damping = elastic, damping
        self.name, self.mesh = elastic.name, elastic.mesh
        self.contact_radius = elastic.contact_radius

    def respond(self, loads: Sequence[Load], before: Response | None = None) -> ViscousResponse:
        """Return the response one tick after `before`, closer to the equilibrium under `loads`."""
        b, earlier = self.damping, list[DecayingLoad]()
        previous: Response | None = None
        if isinstance(before, ViscousResponse):
            earlier, previous = list(before.carried), before.elastic
        carried: list[DecayingLoad] = []
        for load in loads:
            force = load.force
            for other in earlier:
                # A contact that has not moved continues its load of the previous tick.
                if _same_contact(load, other.load):
                    force += b * other.load.force
                    earlier.remove(other)
                    break
            force /= 1.0 + b
            carried.append(DecayingLoad(replace(load, force=force), abs(force)))
        for other in earlier:
            force = other.load.force * b / (1.0 + b)
            if abs(force) > _NEGLIGIBLE * other.peak:
                carried.append(DecayingLoad(replace(other.load, force=force), other.peak))
        response = self.elastic.respond([one.load for one in carried], previous)
        return ViscousResponse(response, len(loads), carried)

    def prefetch(self, vertices: Ints) -> None:
        """Announce the vertices that sliding fingers will press soon, shape (k,)."""
        if isinstance(self.elastic, Prefetching):
            self.elastic.prefetch(vertices)

    def vertex_compliance(self) -> Floats:
        """Return the compliance of a contact at each vertex along its normal, shape (n,) [m/N]."""
        return vertex_compliance(self.elastic)


def _same_contact(one: Load, other: Load) -> bool:
    return (
        np.array_equal(one.vertices, other.vertices)
        and np.array_equal(one.weights, other.weights)
        and np.array_equal(one.direction, other.direction)
    )
