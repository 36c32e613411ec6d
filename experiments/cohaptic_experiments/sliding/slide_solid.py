"""A finger that slides over a fine solid while its columns are still being found.

The session is virtual, and so is the worker: every tenth of a second it delivers missing columns,
as the one of a server does (`shell/column_worker.py`). The measure is the largest step of the force
while columns arrive and are evicted under the finger.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cohaptic_experiments.sliding.slide import Way, felt_along, true_forces
from cohaptic_experiments.virtual_session import PERIOD
from cohaptic_server.bodies.body import Load, Response
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.room.body_frames import describe

_BRINGS = 6  # ticks between two batches of columns
_BATCH = 24


class ServedSolid(Solid):
    """A solid whose columns come while it is touched."""

    _ticks = 0

    def respond(self, loads: Sequence[Load], before: Response | None = None) -> Response:
        """As `Solid`, a batch of columns every few ticks."""
        self._ticks += 1
        if self._ticks % _BRINGS == 0:
            self.solve_missing(_BATCH)
        return super().respond(loads, before)


@dataclass(frozen=True, slots=True)
class Steps:
    """Force on a sliding finger.

    Args:
        step: Largest change of the force between two periods of 1 ms, over the force.
        error: Largest error against the exact body, over its force, at some places of the way.
        force: Mean [N].
        lost: Time with less than half of the force, while it sets off [s].
    """

    step: float
    error: float
    force: float
    lost: float


def slide(
    body: ServedSolid, exact: Solid, *, speed: float, delay: float, depth: float = 0.004
) -> Steps:
    """Slide along the outer circle of a ring, mesh patches, no friction.

    Args:
        body: In the background.
        exact: The same, exact.
        speed: [m/s].
        delay: One way [s].
        depth: Below the resting surface [m].
    """
    about = describe(body)
    way = Way(about.center, about.radius, depth, speed, 0.5 * math.pi, delay)
    forces = felt_along(body, way, "mesh")
    start, first, last = (round(t / PERIOD) for t in (way.start, *way.steady))
    felt = forces[first:last]
    some = range(first, last, max(1, (last - first) // 16))
    reference = true_forces(exact, [way.position(i * PERIOD) for i in some])
    there = felt[[i - first for i in some]]
    return Steps(
        float((np.abs(np.diff(felt)) / felt[1:]).max()),
        float((np.abs(there - reference) / reference).max()),
        float(felt.mean()),
        PERIOD * int((forces[start:first] < 0.5 * forces[start]).sum()),
    )
