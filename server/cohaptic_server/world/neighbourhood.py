"""The part of the free surface that a mesh patch carries: all that the probe can reach in time.

These are the vertices of the touch mesh (`touch_mesh.py`) round the contact and, for a hand that
slides, along its path over the surface for as long as the patch will be in use. If a frame cannot
hold all of them, the nearest are taken.
"""

from __future__ import annotations

import math

import numpy as np

from cohaptic.protocol.neighbourhood import MAX_VERTICES, Neighbourhood
from cohaptic_server.bodies.touched_body import TouchedBody
from cohaptic_server.mesh.touch_mesh import MAX_PATH, TouchMesh
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.world.packing import FIELDS, largest, pack

MIN_RADIUS = 0.04  # m round the contact, before the support of the client's weights is added
SPEEDING_UP = 0.15  # m/s by which a hand may become faster while a patch is in use
_SUPPORT = 1.8  # vertex spacings; support of the client's weights (`mesh_fit.SUPPORT`)
# Margin on the radius of the disc that `MAX_VERTICES` cover, since vertices may lie further apart
# than the mean spacing.
_DISC_MARGIN = 1.3
_LARGEST = np.zeros(2)  # room for one neighbourhood after the other


def _half_width(mesh: TouchMesh, horizon: float) -> float:
    """Largest distance of a vertex from the path of the contact [m].

    It covers all that can be reached, or the disc of `MAX_VERTICES` if that is smaller.
    """
    spacing = mesh.spacing
    widest = _DISC_MARGIN * spacing * math.sqrt(MAX_VERTICES / math.pi)
    return min(max(MIN_RADIUS, SPEEDING_UP * horizon) + _SUPPORT * spacing, widest)


def cut_neighbourhood(
    touched_body: TouchedBody, displacement: Floats, touched: Ints
) -> Neighbourhood:
    """The neighbourhood of one contact.

    Args:
        touched_body: The deformable object and its touch mesh.
        displacement: Of these vertices without this user's own force, shape (k, 3) [m].
        touched: Vertices of the touch mesh, shape (k,).
    """
    return quantised(touched, displacement, touched_body.touch_compliance[touched])


def quantised(vertices: Ints, displacement: Floats, c_ii: Floats) -> Neighbourhood:
    """`Neighbourhood.of` for arrays, in two compiled loops.

    Args:
        vertices: Rising, at most 65,535, shape (k,).
        displacement: Shape (k, 3) [m].
        c_ii: Not negative, shape (k,) [m/N].

    Returns:
        Where a value is not as above, one that `encode` refuses: it costs its user, not the tick.

    Raises:
        ValueError: The vertices are not as above, or the shapes do not fit.
    """
    if displacement.shape != (len(vertices), 3) or c_ii.shape != (len(vertices),):
        raise ValueError(
            f"{len(vertices)} vertices, displacements of shape {displacement.shape} and"
            f" compliances of shape {c_ii.shape} make no neighbourhood"
        )
    if not largest(displacement, c_ii, _LARGEST):
        return Neighbourhood(math.nan, math.nan, b"")
    scale, c_scale = Neighbourhood.scales(*_LARGEST.tolist())
    numbers = np.empty((len(vertices), FIELDS), np.uint16)
    per, c_per = 1.0 / scale if scale else 0.0, 1.0 / c_scale if c_scale else 0.0
    if not pack(vertices, displacement, c_ii, per, c_per, numbers):
        raise ValueError(f"vertices of a neighbourhood must rise to at most 65535: {vertices}")
    return Neighbourhood(scale, c_scale, numbers.astype("<u2", copy=False).tobytes())


def path_ahead(mesh: TouchMesh, speed: float, horizon: float) -> tuple[float, float]:
    """Path of a sliding contact round which vertices are carried.

    Args:
        mesh: Touch mesh of the body.
        speed: Along the surface [m/s].
        horizon: Duration of the path [s].

    Returns:
        Its length, and the largest distance of a vertex from it [m].
    """
    return min(MAX_PATH, speed * horizon), _half_width(mesh, horizon)
