"""Vertices that a mesh patch carries: all that the probe can reach while the patch is in use.

They are vertices of the touch mesh (`touch_mesh.py`) round the contact and, for a hand that
slides, along its path over the surface for as long as the patch will be in use. If a frame cannot
hold all of them, the nearest vertices are taken.
"""

from __future__ import annotations

import math

import numpy as np

from cohaptic.protocol.neighbourhood import ITEM_SIZE, MAX_VERTICES, Neighbourhood
from cohaptic_server.mesh.touch_mesh import MAX_PATH, TouchMesh
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.world.loops.packing import FIELDS, largest, pack

MIN_RADIUS = 0.04  # m round the contact, before the support of the client's weights is added
SPEEDING_UP = 0.15  # m/s by which a hand may become faster while a patch is in use
_SUPPORT = 1.8  # vertex spacings; support of the client's weights (`mesh_fit.SUPPORT`)
# Margin on the radius of the disc that `MAX_VERTICES` cover, since vertices may lie further apart
# than the mean spacing.
_DISC_MARGIN = 1.3
_UNITS = np.array([2.0**15 - 1.0, 2.0**16 - 1.0])  # largest displacement, compliance in units
_SMALLEST = 2.0**-126  # smallest normal number in single precision; smaller scales become 0
_UNUSABLE = Neighbourhood(math.nan, math.nan, b"")


def _half_widths(mesh: TouchMesh, horizons: Floats) -> Floats:
    """Largest distance of a vertex from the path of each contact, shape (n,) [m].

    The distance covers all that the probe can reach, or the disc of `MAX_VERTICES` if that is
    smaller.
    """
    spacing = mesh.spacing
    widest = _DISC_MARGIN * spacing * math.sqrt(MAX_VERTICES / math.pi)
    reached = np.maximum(MIN_RADIUS, SPEEDING_UP * horizons)
    return np.minimum(reached + _SUPPORT * spacing, widest)


def quantised(
    starts: Ints, vertices: Ints, displacement: Floats, c_ii: Floats
) -> list[Neighbourhood]:
    """Encode several neighbourhoods as `Neighbourhood.of` does one, in two compiled loops.

    Args:
        starts: Where each of n neighbourhoods begins, and where the last ends, shape (n + 1,).
        vertices: Vertices of each neighbourhood, rising, at most 65,535, shape (k,).
        displacement: Displacement of each vertex, finite, shape (k, 3) [m].
        c_ii: Compliance of each vertex, finite and not negative, shape (k,) [m/N].

    Returns:
        The neighbourhoods. A neighbourhood with a value out of range is made unusable, so that
        `encode` refuses it: only the user concerned loses a patch, and the tick goes on.

    Raises:
        ValueError: The vertices are out of order or range, or the shapes do not fit.
    """
    if displacement.shape != (len(vertices), 3) or c_ii.shape != (len(vertices),):
        raise ValueError(
            f"{len(vertices)} vertices, displacements of shape {displacement.shape} and"
            f" compliances of shape {c_ii.shape} make no neighbourhood"
        )
    most = np.empty((len(starts) - 1, 2))
    largest(starts, displacement, c_ii, most)
    scales = _scales(most)
    # Values that are not finite are packed as zeros: Python and C have no integers for them.
    known = (scales > 0.0) & (scales[:, :1] >= 0.0)
    per = np.where(known, 1.0 / np.where(known, scales, 1.0), 0.0)
    numbers = np.empty((len(vertices), FIELDS), np.uint16)
    if (wrong := pack(starts, vertices, displacement, c_ii, per, numbers)) < len(per):
        own = vertices[starts[wrong] : starts[wrong + 1]]
        raise ValueError(f"vertices of a neighbourhood must rise to at most 65535: {own}")
    packed = numbers.astype("<u2", copy=False).tobytes()
    ends: list[int] = (ITEM_SIZE * starts).tolist()
    return [
        Neighbourhood(scale, c_scale, packed[a:b]) if scale >= 0.0 else _UNUSABLE
        for (scale, c_scale), a, b in zip(scales.tolist(), ends[:-1], ends[1:], strict=True)
    ]


def _scales(most: Floats) -> Floats:
    """`Neighbourhood.scales` of each row of `most`, shape (n, 2); negative scales stay negative."""
    wanted = most / _UNITS
    single = (wanted * (1.0 + 1e-7)).astype(np.float32).astype(np.float64)
    return np.where(np.abs(wanted) < _SMALLEST, 0.0, single)


def path_ahead(mesh: TouchMesh, speeds: Floats, horizons: Floats) -> tuple[Floats, Floats]:
    """Find the paths of sliding contacts round which vertices are carried.

    Args:
        mesh: Touch mesh of the body.
        speeds: Speed of each contact along the surface, shape (n,) [m/s].
        horizons: Duration of each path, shape (n,) [s].

    Returns:
        Length of each path, and largest distance of a vertex from it, shape (n,) each [m].
    """
    return np.minimum(MAX_PATH, speeds * horizons), _half_widths(mesh, horizons)
