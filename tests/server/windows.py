"""The window round one contact, as values."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cohaptic_server.bodies.touched_body import TouchedBody
from cohaptic_server.numeric import Floats, Ints


class Chosen(NamedTuple):
    """Vertices of one window, as `ContactWindows` leaves them."""

    vertices: Ints
    fitted: Ints
    touched: Ints
    carried: Ints


def choose(
    body: TouchedBody,
    foot: Floats,
    normal: Floats,
    radius: float,
    reach: float,
    path: tuple[Floats, float, float],
    limit: int,
) -> Chosen:
    """The window of a contact; the path is its direction, its length and its half width."""
    found = body.windows
    direction, length, half_width = path
    found.search.choose(
        foot, normal, radius, reach, direction, length, body.mesh.spacing, half_width, limit
    )
    search = found.search
    return Chosen(
        np.array(found.vertices[: search.count]),
        np.array(found.fitted[: search.fits]),
        np.array(found.touched[: search.carries]),
        np.array(found.carried[: search.carries]),
    )
