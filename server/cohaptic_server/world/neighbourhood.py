"""What of the free surface a mesh patch carries: what the probe can reach before the next news.

The vertices of the touch mesh (`touch_mesh.py`) round the contact, and ahead of a hand that slides:
along its way over the surface for as long as this patch will be in use. Nearest first, as many as a
frame holds.
"""

from __future__ import annotations

import math

import numpy as np

from cohaptic.protocol.neighbourhood import MAX_VERTICES, Neighbourhood
from cohaptic_server.bodies.touched_body import TouchedBody
from cohaptic_server.mesh.touch_mesh import TouchMesh
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.world.displacement_field import Window

# Round the contact, and the width of the client's weights on top.
REACH = 0.04  # m
SPEEDING_UP = 0.15  # m/s that a hand may be faster before the next news than it was
_WIDTH = 1.8  # distances between vertices (`mesh_surface.SUPPORT`)
_FURTHEST = 0.3  # m ahead of the contact
_ROOMY = 1.3  # over the disc of as many vertices as a frame holds: they may lie further apart


def _beside(mesh: TouchMesh, horizon: float) -> float:
    """How far from the way of a contact: what is reached, or what a frame holds if it is less [m].

    A disc of `MAX_VERTICES` is the widest that can be sent.
    """
    apart = mesh.spacing
    widest = _ROOMY * apart * math.sqrt(MAX_VERTICES / math.pi)
    return min(max(REACH, SPEEDING_UP * horizon) + _WIDTH * apart, widest)


def cut_neighbourhood(touched_body: TouchedBody, free: Window, touched: Ints) -> Neighbourhood:
    """The neighbourhood of one contact.

    Args:
        touched_body: The deformable object and its touch mesh.
        free: Displacement round the contact without this user's own force.
        touched: Vertices of the touch mesh, as of `choose_vertices`.
    """
    vertices = touched_body.mesh.vertices[touched]
    compliance = touched_body.vertex_compliance[vertices]
    return quantised(touched, free[vertices], compliance)


def quantised(vertices: Ints, displacement: Floats, c_ii: Floats) -> Neighbourhood:
    """`Neighbourhood.of` for arrays, which a tick has not the time to take apart.

    Args:
        vertices: Rising, shape (k,).
        displacement: Shape (k, 3) [m].
        c_ii: Shape (k,) [m/N].
    """
    scale, c_scale = Neighbourhood.scales(
        float(np.abs(displacement).max(initial=0.0)), float(c_ii.max(initial=0.0))
    )
    units = np.rint(displacement * (1.0 / scale if scale else 0.0)).astype(np.int64)
    c_units = np.rint(c_ii * (1.0 / c_scale if c_scale else 0.0)).astype(np.int64)
    return Neighbourhood(
        scale,
        c_scale,
        tuple(vertices.tolist()),
        tuple(zip(*units.T.tolist(), strict=True)),
        tuple(c_units.tolist()),
    )


def choose_vertices(mesh: TouchMesh, at: Floats, slide: Floats, horizon: float) -> Ints:
    """Which vertices are nearest to the way of a sliding contact, all of it at rest.

    Args:
        mesh: That is touched.
        at: Contact point, shape (3,) [m].
        slide: Velocity along the surface, shape (3,) [m/s].
        horizon: How long the way is [s].

    Returns:
        As `TouchMesh` numbers them, rising, at most `MAX_VERTICES`.
    """
    beside = _beside(mesh, horizon)
    length = min(_FURTHEST, math.sqrt(slide @ slide) * horizon)
    near = mesh.near(at, length + beside)
    if not len(near):
        return near
    points = mesh.points[near]
    # Points of the way as far apart as vertices leave no gap between the discs round them.
    stops = way(points, mesh.normals[near], at, slide, length, mesh.spacing)
    squares = (
        np.einsum("ni,ni->n", points, points)[:, None]
        + np.einsum("wi,wi->w", stops, stops)
        - 2.0 * (points @ stops.T)
    ).min(axis=1)
    most = min(MAX_VERTICES, len(squares))
    nearest = np.argpartition(squares, most - 1)[:most]
    return np.sort(near[nearest[squares[nearest] <= beside**2]])


def way(
    points: Floats, normals: Floats, at: Floats, slide: Floats, length: float, step: float
) -> Floats:
    """Points along the surface from a contact in the direction of its slide, shape (w, 3) [m].

    Args:
        points: Of the surface round the contact, shape (k, 3) [m].
        normals: There, shape (k, 3).
        at: Contact point, shape (3,) [m].
        slide: Its direction, of any length, shape (3,).
        length: Of the way [m].
        step: Between two points [m].
    """
    here, found, heading = at, [at], slide
    squares = np.einsum("ni,ni->n", points, points)
    for _ in range(math.ceil(length / step - 1e-9)):
        stride = min(step, length)
        length -= stride
        here = here + (stride / max(1e-12, math.sqrt(heading @ heading))) * heading
        # Back onto the surface, and along it, by the vertex nearest to here.
        k = int((squares - 2.0 * (points @ here)).argmin())
        n = normals[k]
        here = here + ((points[k] - here) @ n) * n
        heading = heading - (heading @ n) * n
        found.append(here)
    return np.array(found)
