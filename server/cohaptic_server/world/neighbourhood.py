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
from cohaptic_server.mesh.touch_mesh import TouchMesh
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.world.displacement_field import CachedField

MIN_RADIUS = 0.04  # m round the contact, before the support of the client's weights is added
SPEEDING_UP = 0.15  # m/s by which a hand may become faster while a patch is in use
_SUPPORT = 1.8  # vertex spacings; support of the client's weights (`mesh_surface.SUPPORT`)
_MAX_PATH = 0.3  # m ahead of the contact
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


def cut_neighbourhood(touched_body: TouchedBody, free: CachedField, touched: Ints) -> Neighbourhood:
    """The neighbourhood of one contact.

    Args:
        touched_body: The deformable object and its touch mesh.
        free: Displacement round the contact without this user's own force.
        touched: Vertices of the touch mesh, from `choose_vertices`.
    """
    vertices = touched_body.mesh.vertices[touched]
    compliance = touched_body.vertex_compliance[vertices]
    return quantised(touched, free[vertices], compliance)


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
    length = min(_MAX_PATH, math.sqrt(velocity @ velocity) * horizon)
    near = mesh.near(x_contact, length + half_width)
    if not len(near):
        return near
    points = mesh.points[near]
    # Path points no further apart than vertices leave no gap between the discs round them.
    path = slide_path(points, mesh.normals[near], x_contact, velocity, length, mesh.spacing)
    squares = (
        np.einsum("ni,ni->n", points, points)[:, None]
        + np.einsum("wi,wi->w", path, path)
        - 2.0 * (points @ path.T)
    ).min(axis=1)
    count = min(MAX_VERTICES, len(squares))
    nearest = np.argpartition(squares, count - 1)[:count]
    return np.sort(near[nearest[squares[nearest] <= half_width**2]])


def slide_path(
    points: Floats,
    normals: Floats,
    start: Floats,
    direction: Floats,
    length: float,
    step: float,
) -> Floats:
    """Points along the surface from a contact in the direction of its slide, shape (w, 3) [m].

    Args:
        points: Vertices round the contact, shape (k, 3) [m].
        normals: At these vertices, shape (k, 3).
        start: Contact point, shape (3,) [m].
        direction: Of the slide, of any length, shape (3,).
        length: Of the path [m].
        step: Between two points of the path [m].
    """
    point, path, heading = start, [start], direction
    squares = np.einsum("ni,ni->n", points, points)
    for _ in range(math.ceil(length / step - 1e-9)):
        stride = min(step, length)
        length -= stride
        point = point + (stride / max(1e-12, math.sqrt(heading @ heading))) * heading
        # Project point and heading onto the tangent plane of the nearest vertex.
        k = int((squares - 2.0 * (points @ point)).argmin())
        n = normals[k]
        point = point + ((points[k] - point) @ n) * n
        heading = heading - (heading @ n) * n
        path.append(point)
    return np.array(path)
