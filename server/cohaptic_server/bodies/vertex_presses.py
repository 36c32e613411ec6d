"""Presses at many vertices of a resting surface, computed with operations on whole arrays.

`pressure` of `mesh/surface.py` computes one press in a loop over quadrature points. The loop is
compiled for ticks; as plain Python it takes 40 ms where a finger covers 8000 points, and a body
without a table of its own is pressed at every vertex of its touch mesh before a room opens. Here a
press takes under a millisecond either way.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from cohaptic_server.bodies.body import Load
from cohaptic_server.mesh.surface import Quadrature, SurfaceMesh, pressure
from cohaptic_server.numeric import Floats, Ints

# As in `mesh/search/pressure_search.py`, whose constants are hidden once it is compiled; a test
# compares the two.
_BESIDE, _BEHIND = 0.0, -0.5
_ROUNDING = 1e-9  # relative; a tree may round squares in another way than `_force_of_points` does


def presses_at(mesh: SurfaceMesh, vertices: Ints, radius: float) -> Iterator[Load]:
    """Yield a load of zero force at each of some vertices, against the vertex's normal.

    The shares are those of `pressure`, but for the order in which parts are added.

    Args:
        mesh: Resting surface.
        vertices: Vertices to press, shape (k,).
        radius: Contact radius [m].
    """
    points, n = mesh.quadrature, len(mesh.vertices)
    for vertex in vertices.tolist():
        at, normal = mesh.vertices[vertex], mesh.normals[vertex]
        near = points.tree.query_ball_point(at, radius * (1.0 + _ROUNDING))
        found = np.array(near, dtype=np.int64)
        force = _force_of_points(points, found, at, normal, radius)
        if not force.any():  # the radius is below the resolution of the mesh
            yield Load(*pressure(mesh, at, radius, normal), -normal, 0.0)
            continue
        parts = force[:, None] * points.fractions[found]
        table = np.bincount(points.vertices[found].ravel(), parts.ravel(), n)
        under = np.flatnonzero(table)
        yield Load(under, table[under] / force.sum(), -normal, 0.0)


def _force_of_points(
    points: Quadrature, found: Ints, at: Floats, normal: Floats, radius: float
) -> Floats:
    """Return the force of a press on some quadrature points, in any unit, shape (k,).

    Args:
        points: Quadrature points of the surface.
        found: Points to compute, shape (k,).
        at: Centre of the press, shape (3,) [m].
        normal: Outward unit normal of the finger, shape (3,).
        radius: Contact radius [m].
    """
    limit = radius * radius
    off = points.points[found] - at
    square = off[:, 0] ** 2 + off[:, 1] ** 2 + off[:, 2] ** 2
    facing = points.outward[found] @ normal
    fraction = np.clip((facing - _BEHIND) / (_BESIDE - _BEHIND), 0.0, 1.0)
    profile = np.maximum(1e-12, 1.0 - square / limit)
    return np.where(square <= limit, fraction * profile * points.areas[found], 0.0)
