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

MIN_RADIUS = 0.04  # m round the contact, before the support of the client's weights is added
SPEEDING_UP = 0.15  # m/s by which a hand may become faster while a patch is in use
_SUPPORT = 1.8  # vertex spacings; support of the client's weights (`mesh_surface.SUPPORT`)
# Margin on the radius of the disc that `MAX_VERTICES` cover, since vertices may lie further apart
# than the mean spacing.
_DISC_MARGIN = 1.3
# One vertex in the frame of a patch (`protocol.neighbourhood`), packed.
_ITEM = np.dtype([("index", "<u2"), ("displacement", "<i2", (3,)), ("compliance", "<u2")])


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
        touched: Vertices of the touch mesh, from `choose_vertices`.
    """
    vertices = touched_body.mesh.vertices[touched]
    compliance = touched_body.vertex_compliance[vertices]
    return quantised(touched, displacement, compliance)


def quantised(vertices: Ints, displacement: Floats, c_ii: Floats) -> Neighbourhood:
    """`Neighbourhood.of` for arrays, without a Python loop over the vertices.

    Args:
        vertices: Rising, at most 65,535, shape (k,).
        displacement: Shape (k, 3) [m].
        c_ii: Not negative, shape (k,) [m/N].

    Raises:
        ValueError: The vertices are not as above.
    """
    if len(vertices) and not (vertices[-1] < 2**16 and (vertices[1:] > vertices[:-1]).all()):
        raise ValueError(f"vertices of a neighbourhood must rise to at most 65535: {vertices}")
    scale, c_scale = Neighbourhood.scales(
        float(np.abs(displacement).max(initial=0.0)), float(c_ii.max(initial=0.0))
    )
    items = np.empty(len(vertices), _ITEM)
    items["index"] = vertices
    items["displacement"] = np.rint(displacement * (1.0 / scale if scale else 0.0))
    items["compliance"] = np.rint(c_ii * (1.0 / c_scale if c_scale else 0.0))
    return Neighbourhood(scale, c_scale, items.tobytes())


def choose_vertices(mesh: TouchMesh, x_contact: Floats, velocity: Floats, horizon: float) -> Ints:
    """Choose the vertices nearest to the path of a sliding contact, on the resting surface.

    Args:
        mesh: Touch mesh of the body.
        x_contact: Contact point, shape (3,) [m].
        velocity: Along the surface, shape (3,) [m/s].
        horizon: Duration of the path [s].

    Returns:
        Numbers in the touch mesh, ascending, at most `MAX_VERTICES`.
    """
    half_width = _half_width(mesh, horizon)
    length = min(MAX_PATH, math.sqrt(velocity @ velocity) * horizon)
    count = mesh.window.along(x_contact, velocity, length, mesh.spacing, half_width, MAX_VERTICES)
    return np.sort(mesh.found[:count])
