"""Nearest points on a surface."""

from __future__ import annotations

import numpy as np

from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.numeric import Floats


def nearest_point(mesh: SurfaceMesh, p: Floats) -> Floats:
    """Nearest point of the resting surface to `p` (3,) [m], shape (3,) [m].

    It is sought on the face of the nearest quadrature point and on that face's neighbours.
    """
    x, y, z = p.tolist()
    near = mesh.contacts.near
    near.nearest(x, y, z)
    return np.array(near.foot)
