"""The surface free of one user's own force on all vertices, and how it bulges."""

from __future__ import annotations

import numpy as np

from cohaptic_server.bodies.body import Response
from cohaptic_server.mesh.curvature import fit_radius
from cohaptic_server.mesh.search.bulge_fit import fit_bulge
from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.world.displacement_field import FreeField


def free_of(response: Response, i: int, force: float) -> Floats:
    """Displacement without the force of load i, shape (n, 3) [m]."""
    every = np.arange(len(response.displacement))
    return FreeField(response, np.array([force]), slice(i, i + 1))[every]


def bulge(mesh: SurfaceMesh, vertices: Ints, moved: Floats, frame: Floats, contact: float) -> float:
    """Largest outward curvature that a displacement adds to a surface round a contact [1/m]."""
    radius, room = fit_radius(mesh, contact), np.zeros((6, 8))
    return fit_bulge(mesh.vertices, mesh.normals, vertices, moved, frame, radius, room)
