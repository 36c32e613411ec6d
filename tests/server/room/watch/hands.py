"""Hands that slide and press, for tests of what is shown of them."""

from __future__ import annotations

import math
from collections.abc import Iterator

from cohaptic.control.law import Law
from cohaptic.protocol.patch import Geometry, Patch
from cohaptic_server.bodies.body import Body
from cohaptic_server.bodies.touched_body import TouchedBody
from cohaptic_server.world.state import Participant, Touch
from cohaptic_server.world.tick import advance
from cohaptic_server.world.users import WorldState

PERIOD = 1.0 / 60.0  # s


def touches(tick: int, users: int = 2, *, still: bool = False) -> list[Touch]:
    """Everybody round the equator, with up to 5 N; the second has friction."""
    found: list[Touch] = []
    phase = 0 if still else tick
    for user in range(users):
        angle = 2.0 * math.pi * user / users + 0.4 * math.sin(0.05 * phase + user)
        out = (math.cos(angle), math.sin(angle), 0.0)
        force = 3.0 + 2.0 * math.sin(0.1 * phase + user)
        found.append(
            Touch(
                who=Participant(
                    user=user + 1,
                    law=Law.PREDICTIVE,
                    max_stiffness=1000.0,
                    max_force=10.0,
                    geometry=Geometry.SPHERE,
                    friction=user % 2 == 1,
                ),
                probe=(0.09 * out[0], 0.09 * out[1], 0.0),
                force=(force * out[0], force * out[1], 0.2 * force * (user % 2)),
                seq=tick,
                tick=max(0, tick - 2),
                t_client=tick * PERIOD,
                arrived=tick * PERIOD,
            )
        )
    return found


def motion(
    body: Body, ticks: int, users: int = 2, *, still: bool = False
) -> Iterator[tuple[WorldState, dict[int, Patch]]]:
    """The world after each tick, and its patches."""
    world = WorldState()
    for tick in range(1, ticks + 1):
        hands = touches(tick, users, still=still)
        world, patches = advance(TouchedBody(body), world, hands, now=tick * PERIOD, dt=PERIOD)
        yield world, patches
