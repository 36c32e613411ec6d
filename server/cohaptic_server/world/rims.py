"""Where a finger that presses in touches what it presses on, and not the face beside it."""

from __future__ import annotations

from itertools import product

import numpy as np
import numpy.typing as npt

from cohaptic.control.friction import tangents
from cohaptic_server.bodies.body import Body
from cohaptic_server.numeric import Ints, vec3
from cohaptic_server.world.contact import locate
from cohaptic_server.world.displacement_field import ZeroField

# In contact radii, below the surface and beside the vertex: on the middle of a rim a finger stands
# as on the edge of a knife.
_INSIDE, _ASIDE = 0.05, 0.1
_SQUARE = 0.9  # cosine, about 25 degrees: a finger that comes so far aslant still presses


def is_met_squarely(body: Body, vertices: Ints) -> npt.NDArray[np.bool_]:
    """Whether a finger that presses in along each vertex's normal touches there, shape (k,).

    On a rim that is narrower than a fingertip the contact slides to the face beside it, and a hand
    that comes from the side presses past the object.

    Args:
        body: At rest.
        vertices: Of its surface, shape (k,).
    """
    return np.array([_meets_squarely(body, k) for k in vertices.tolist()], dtype=np.bool_)


def _meets_squarely(body: Body, vertex: int) -> bool:
    x, n, radius = body.mesh.vertices[vertex], body.mesh.normals[vertex], body.contact_radius
    beside = [sign * np.array(t) for sign, t in product((-1.0, 1.0), tangents(vec3(n)))]
    for way in (np.zeros(3), *beside):
        tip = x + radius * (_ASIDE * way - _INSIDE * n)
        found = locate(body.mesh, tip, ZeroField(), radius=radius)
        if float(found.normal @ n) < _SQUARE:
            return False
    return True
