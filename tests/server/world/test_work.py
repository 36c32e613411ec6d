"""The work of a tick is that of its contacts, whatever the size of the mesh."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from types import FrameType

from cohaptic.protocol.patch import Geometry
from cohaptic_server.bodies.balloon.balloon import Balloon, BalloonSettings
from cohaptic_server.bodies.touched_body import TouchedBody
from cohaptic_server.world.state import Touch
from cohaptic_server.world.tick import advance
from cohaptic_server.world.users import WorldState
from tests.server.touches import changed, touch

PERIOD = 1.0 / 60.0  # s
SPEED = 0.2  # m/s


def sliding(users: int, tick: int, geometry: Geometry) -> list[Touch]:
    """Hands that slide along the equator."""
    made: list[Touch] = []
    for user in range(users):
        angle = 2.0 * math.pi * user / users + SPEED * tick * PERIOD / 0.1
        out = (math.cos(angle), math.sin(angle), 0.0)
        probe = (0.096 * out[0], 0.096 * out[1], 0.0)
        made.append(
            changed(
                touch(user + 1, force=1.0),
                probe=probe,
                force=out,
                seq=tick + 1,
                tick=tick,
                t_client=tick * PERIOD,
                geometry=geometry,
            )
        )
    return made


def calls(body: TouchedBody, users: int, geometry: Geometry) -> int:
    """Calls in one tick of hands that have slid for a while."""
    state, ticks, count = WorldState(), 12, 0
    kernels = {str(path.with_suffix(".py")) for path in Path().glob("server/**/*.pxd")}

    def tally(frame: FrameType, event: str, _: object) -> None:
        nonlocal count
        file = frame.f_code.co_filename
        if event in ("call", "c_call") and not any(file.endswith(name) for name in kernels):
            count += 1

    for tick in range(ticks):
        hands = sliding(users, tick, geometry)
        if tick == ticks - 1:
            sys.setprofile(tally)
        try:
            state, _ = advance(body, state, hands, now=tick * PERIOD, dt=PERIOD)
        finally:
            sys.setprofile(None)
    return count


def test_a_finer_mesh_adds_no_calls(balloon: Balloon) -> None:
    """The work of a tick is that of its contacts, whatever the size of the mesh."""
    coarse = TouchedBody(Balloon(BalloonSettings(subdivisions=2)))
    fine = TouchedBody(balloon)
    counts = [calls(body, 3, Geometry.PLANE) for body in (coarse, fine)]
    assert counts[1] <= 1.1 * counts[0]
