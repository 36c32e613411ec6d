"""What of the free surface a mesh patch carries: what the probe can reach before the next news.

The vertices round the contact, and ahead of a hand that slides: along its way over the surface for
as long as this patch will be in use. Nearest first, as many as a frame holds.
"""

from __future__ import annotations

import math
from typing import Protocol, runtime_checkable
from weakref import WeakKeyDictionary

import numpy as np

from cohaptic.protocol.neighbourhood import MAX_VERTICES, Neighbourhood
from cohaptic_server.bodies.body import Body, Load
from cohaptic_server.bodies.mesh import Floats, Ints, SurfaceMesh
from cohaptic_server.contact import pressure
from cohaptic_server.curvature import spacing

# Round the contact, and the width of the client's weights on top.
REACH = 0.04  # m
SPEEDING_UP = 0.15  # m/s that a hand may be faster before the next news than it was
_WIDTH = 1.8  # distances between vertices (`mesh_surface.SUPPORT`)
_FURTHEST = 0.3  # m ahead of the contact


@runtime_checkable
class Surveyed(Protocol):
    """A body with a quicker way to its table than a response for each vertex."""

    def vertex_compliance(self) -> Floats:
        """C_ii of a contact centred at each vertex, along its normal, shape (n,) [m/N]."""
        ...


_TABLES: WeakKeyDictionary[Body, Floats] = WeakKeyDictionary()


def vertex_compliance(body: Body) -> Floats:
    """C_ii of a contact centred at each vertex, along its normal, shape (n,) [m/N].

    Of the body at rest; a patch carries its own c_ii, by which the client scales these. Found once
    for each body.
    """
    if body not in _TABLES and isinstance(body, Surveyed):
        _TABLES[body] = body.vertex_compliance()
    elif body not in _TABLES:
        mesh = body.mesh
        table = np.empty(len(mesh.vertices))
        for k, (at, normal) in enumerate(zip(mesh.vertices, mesh.normals, strict=True)):
            load = Load(*pressure(mesh, at, body.contact_radius), -normal, 0.0)
            table[k] = max(0.0, body.respond([load]).compliance[0, 0])
        _TABLES[body] = table
    return _TABLES[body]


def cut_neighbourhood(
    body: Body, free: Floats, at: Floats, normal: Floats, velocity: Floats, horizon: float
) -> Neighbourhood:
    """The neighbourhood of one contact.

    Args:
        body: That is touched.
        free: Displacement without this user's own force, shape (n, 3) [m].
        at: Contact point on that surface, shape (3,) [m].
        normal: Outward unit normal there, shape (3,).
        velocity: Of the probe, shape (3,) [m/s].
        horizon: For how long this patch will be in use [s].
    """
    mesh = body.mesh
    points = mesh.vertices + free
    chosen = choose_vertices(mesh, points, at, velocity - (velocity @ normal) * normal, horizon)
    table = vertex_compliance(body)
    return Neighbourhood.of(
        chosen.tolist(), [(x, y, z) for x, y, z in free[chosen].tolist()], table[chosen].tolist()
    )


def choose_vertices(
    mesh: SurfaceMesh, points: Floats, at: Floats, slide: Floats, horizon: float
) -> Ints:
    """Vertices nearest to the way of a sliding contact, rising, at most `MAX_VERTICES`.

    Args:
        mesh: Resting surface.
        points: Its vertices as displaced, shape (n, 3) [m].
        at: Contact point, shape (3,) [m].
        slide: Velocity along the surface, shape (3,) [m/s].
        horizon: How long the way is [s].
    """
    apart = spacing(mesh)
    # Points of the way as far apart as vertices leave no gap between the discs round them.
    stops = way(mesh, points, at, slide, horizon, apart)
    squares = (
        np.einsum("ni,ni->n", points, points)[:, None]
        + np.einsum("wi,wi->w", stops, stops)
        - 2.0 * (points @ stops.T)
    ).min(axis=1)
    most = min(MAX_VERTICES, len(squares))
    nearest = np.argpartition(squares, most - 1)[:most]
    reach = max(REACH, SPEEDING_UP * horizon) + _WIDTH * apart
    return np.sort(nearest[squares[nearest] <= reach * reach])


def way(
    mesh: SurfaceMesh, points: Floats, at: Floats, slide: Floats, horizon: float, step: float
) -> Floats:
    """Points along the surface from a contact in the direction of its slide, shape (w, 3) [m]."""
    length = min(_FURTHEST, math.sqrt(slide @ slide) * horizon)
    here, found, heading = at, [at], slide
    squares = np.einsum("ni,ni->n", points, points)
    for _ in range(math.ceil(length / step - 1e-9)):
        stride = min(step, length)
        length -= stride
        here = here + (stride / max(1e-12, math.sqrt(heading @ heading))) * heading
        # Back onto the surface, and along it, by the vertex nearest to here.
        k = int((squares - 2.0 * (points @ here)).argmin())
        n = mesh.normals[k]
        here = here + ((points[k] - here) @ n) * n
        heading = heading - (heading @ n) * n
        found.append(here)
    return np.array(found)
