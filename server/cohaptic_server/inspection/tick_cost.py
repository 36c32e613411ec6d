"""Measures the time of a tick on a solid, on this machine."""

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
from cohaptic_server.world.state import Touch
from cohaptic_server.world.tick import advance
from cohaptic_server.world.users import WorldState

USERS = (1, 8)
_TICKS = 31
_PERIOD = 1.0 / 60.0  # s


@dataclass(frozen=True, slots=True)
class TickCost:
    """Times of one solid on one machine.

    Args:
        ticks: Median time of a tick for each number of users, with all columns there [s].
        column_latency: Time until the columns of a new contact are there [s].
        users: The numbers.
    """

    ticks: tuple[float, ...]
    column_latency: float
    users: tuple[int, ...] = USERS


def tick_cost(solid: Solid, clock: Clock, users: tuple[int, ...] = USERS) -> TickCost:
    """Time ticks with presses spread over the surface.

    From then on the solid answers from its far field until columns are there.

    Args:
        solid: The solid.
        clock: Clock for the measurement.
        users: Numbers of users.
    """
    mesh = solid.mesh
    free = np.flatnonzero(~solid.shape.fixed[solid.shape.surface])
    vertices = free[spread_over(mesh.vertices[free], max(users))]
    solid.in_background()
    with threadpool_limits(limits=1):  # as on the server
        start = clock.now()
        _ticks(solid, vertices[:1], clock, 1)
        solid.solve_missing(64)
        latency = clock.now() - start
        medians = tuple(
            float(np.median(_ticks(solid, vertices[:count], clock, _TICKS))) for count in users
        )
    return TickCost(medians, latency, users)


def _ticks(
    solid: Solid, vertices: np.ndarray[tuple[int], np.dtype[np.int64]], clock: Clock, n: int
) -> list[float]:
    x, out = solid.mesh.vertices[vertices], solid.mesh.normals[vertices]
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
            for user in range(len(vertices))
        ]
        start = clock.now()
        state, _ = advance(TouchedBody(solid), state, touches, now=tick * _PERIOD, dt=_PERIOD)
        times.append(clock.now() - start)
        # On a server a thread beside the tick solves for the missing columns.
        while len(solid.missing) and not solid.pending:
            solid.solve_missing(64)
    return times


def _vec(a: Floats) -> Vec3:
    return (float(a[0]), float(a[1]), float(a[2]))
