"""The surface free of one user's own force, on all vertices."""

from __future__ import annotations

import numpy as np

from cohaptic_server.bodies.body import Response
from cohaptic_server.numeric import Floats
from cohaptic_server.world.displacement_field import FreeField


def free_of(response: Response, i: int, force: float) -> Floats:
    """Displacement without the force of load i, shape (n, 3) [m]."""
    every = np.arange(len(response.displacement))
    return FreeField(response, np.array([force]), slice(i, i + 1))[every]
