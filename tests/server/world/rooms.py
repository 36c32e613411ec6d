"""A room in which everything happens: every law and geometry, friction, jumps, and absences."""

from __future__ import annotations

import math
from collections.abc import Iterator

from cohaptic.control.law import Law
from cohaptic.protocol.patch import Geometry, Patch
from cohaptic_server.bodies.body import Body
from cohaptic_server.bodies.touched_body import TouchedBody
from cohaptic_server.world.state import Touch
from cohaptic_server.world.tick import advance
from cohaptic_server.world.users import WorldState
from tests.server.touches import changed, side, touch

DT = 1.0 / 60.0  # s
USERS, TICKS = 7, 24


def hand(user: int, tick: int) -> Touch | None:
    """Hand `user` in a tick; None while it is away."""
    angle = 0.9 * user + (0.1 * user if user % 2 else 0.0) * tick * DT
    if user == 3 and tick >= 8:
        angle += math.pi  # it jumps to the other side
    if user == 5 and 6 <= tick < 12:
        return None
    out = side(angle)
    along = (-out[1], out[0], 0.0)
    pressed = 1.0 + math.sin(0.3 * tick + user)
    force = (pressed * out[0], pressed * out[1], 0.0)
    frictional = user in (2, 6)
    if frictional:
        force = (force[0] + 0.2 * along[0], force[1] + 0.2 * along[1], 0.0)
    return changed(
        touch(user, at=out, depth=-0.01 if user == 4 and tick > 15 else 0.004),
        law=tuple(Law)[user % 3],
        geometry=tuple(Geometry)[(user + tick // 10) % 3],
        force=force,
        friction=frictional,
        fresh=not (user == 7 and 10 <= tick < 14),
        seq=tick + 1,
        tick=max(0, tick - user % 4),
        t_client=tick * DT,
    )


def hands(tick: int) -> list[Touch]:
    """All that are there in a tick."""
    return [found for user in range(1, USERS + 1) if (found := hand(user, tick)) is not None]


def mixed_room(
    body: Body, ticks: int, *, backwards: bool = False
) -> Iterator[tuple[WorldState, dict[int, Patch]]]:
    """The room tick by tick; `backwards` its users come in the opposite order."""
    touched_body, state = TouchedBody(body), WorldState()
    for tick in range(ticks):
        here = hands(tick)
        here = here[::-1] if backwards else here
        state, patches = advance(touched_body, state, here, now=tick * DT, dt=DT)
        yield state, patches


def numbers(patch: Patch) -> list[float]:
    """All numbers of a patch but those of its neighbourhood, which are rounded."""
    return [
        *patch.x_free, *patch.normal, patch.curvature, patch.c_ii, patch.k_h, patch.integral_gain,
        *patch.own_force, *patch.u_others, patch.room.lag, patch.room.coupling,
        min(patch.room.margin, 1e9), *(patch.compliance or ()),
    ]  # fmt: skip
