"""What a tick on a solid costs on this machine, measured on its own surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

from cohaptic.clock import Clock
from cohaptic.control.law import Law
from cohaptic.vec import Vec3
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.bodies.touched_body import TouchedBody
from cohaptic_server.mesh.sampling import spread_over
from cohaptic_server.numeric import Floats
from cohaptic_server.world.state import Touch, WorldState
from cohaptic_server.world.tick import advance

USERS = (1, 8)
_TICKS = 31
_PERIOD = 1.0 / 60.0  # s


@dataclass(frozen=True, slots=True)
class TickCost:
    """Of one solid on one machine.

    Args:
        ticks: Median time of a tick for each of `USERS`, all columns there [s].
        first: Until the columns of a place not touched before are there [s].
    """

    ticks: tuple[float, ...]
    first: float


def tick_cost(solid: Solid, clock: Clock) -> TickCost:
    """Press on places all over the surface; from then on the solid works in the background."""
    mesh = solid.mesh
    free = np.flatnonzero(~solid.shape.fixed[solid.shape.surface])
    places = free[spread_over(mesh.vertices[free], max(USERS))]
    solid.in_background()
    with threadpool_limits(limits=1):  # as on the server
        begun = clock.now()
        _ticks(solid, places[:1], clock, 1)
        solid.solve_missing(64)
        first = clock.now() - begun
        medians = tuple(
            float(np.median(_ticks(solid, places[:users], clock, _TICKS))) for users in USERS
        )
    return TickCost(medians, first)


def _ticks(
    solid: Solid, places: np.ndarray[tuple[int], np.dtype[np.int64]], clock: Clock, n: int
) -> list[float]:
    x, out = solid.mesh.vertices[places], solid.mesh.normals[places]
    state, times = WorldState(), list[float]()
    for tick in range(n):
        touches = [
            Touch(
                user=user + 1,
                law=Law.PREDICTIVE,
                max_stiffness=1000.0,
                max_force=10.0,
                probe=_vec(x[user] - 0.001 * out[user]),
                force=_vec(0.5 * out[user]),
                seq=tick + 1,
                tick=tick,
                t_client=tick * _PERIOD,
                arrived=tick * _PERIOD,
            )
            for user in range(len(places))
        ]
        begun = clock.now()
        state, _ = advance(TouchedBody(solid), state, touches, now=tick * _PERIOD, dt=_PERIOD)
        times.append(clock.now() - begun)
        # What the thread beside the tick does on a server.
        while len(solid.missing) and not solid.pending:
            solid.solve_missing(64)
    return times


def _vec(a: Floats) -> Vec3:
    return (float(a[0]), float(a[1]), float(a[2]))
