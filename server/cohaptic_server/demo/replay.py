"""What everybody would have felt of the others without a network.

The recorded tips and forces of one instant go through the same world as on the server, tick by
tick, with no delay between anybody and the body. How late a real hand felt the others is then the
shift between this and what its loop had, whatever the geometry did meanwhile.
"""

from __future__ import annotations

import numpy as np

from cohaptic.control.law import Law
from cohaptic.vec import Vec3
from cohaptic_server.bodies.body import Body
from cohaptic_server.bodies.mesh import Floats
from cohaptic_server.demo.analysis import STEP, Timeline
from cohaptic_server.world import RELEASE_TIME, advance
from cohaptic_server.world_state import Touch, WorldState

TICK = 0.005  # s


def felt_at_once(timeline: Timeline, body: Body, window: slice) -> Floats:
    """Displacement of each contact by the others, at once, on the grid of a window.

    Args:
        timeline: Of the scene.
        body: What was touched.
        window: Of the grid.

    Returns:
        Shape (users, length of the window) [m].
    """
    stride = round(TICK / STEP)
    ticks = list(range(window.start, window.stop, stride))
    state = WorldState()
    # Everybody is there from before the window: no force of theirs is still rising, and contacts
    # have followed.
    for _ in range(round(RELEASE_TIME / TICK) + 20):
        state, _ = advance(body, state, _touches(timeline, window.start), now=0.0, dt=TICK)
    rows: list[list[float]] = []
    for index in ticks:
        state, patches = advance(body, state, _touches(timeline, index), now=0.0, dt=TICK)
        rows.append([patch.u_others for patch in patches.values()])
    grid = list(range(window.start, window.stop))
    found: Floats = np.array(rows)
    return np.array([np.interp(grid, ticks, found[:, i]) for i in range(found.shape[1])])


def _touches(timeline: Timeline, index: int) -> list[Touch]:
    c = timeline.columns
    return [
        Touch(
            user=user,
            law=Law.PREDICTIVE,  # gains play no part here: the forces are given
            max_stiffness=1e6,
            max_force=100.0,
            probe=_vec(c["x"][user, index], c["y"][user, index], c["z"][user, index]),
            force=_vec(c["fx"][user, index], c["fy"][user, index], c["fz"][user, index]),
            seq=1,
            tick=0,
            t_client=0.0,
            arrived=0.0,
        )
        for user in range(len(c["x"]))
    ]


def _vec(x: float, y: float, z: float) -> Vec3:
    return (float(x), float(y), float(z))
