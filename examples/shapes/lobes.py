"""An organ like a liver: a star-shaped implicit surface of blended lobes.

Its distance from the centre is found by bisection along every direction, so that it has no hole and
one component.
"""

from __future__ import annotations

import numpy as np

from cohaptic_server.mesh.icosphere import icosphere
from cohaptic_server.numeric import Floats
from shapes.grids import Mesh

# Centre, half axes [m] and weight of each lobe; negative weights hollow the underside out.
_LOBES = (
    ((0.030, 0.000, 0.004), (0.062, 0.056, 0.046), 1.0),  # the right one, large
    ((-0.046, 0.012, 0.012), (0.056, 0.040, 0.024), 1.0),  # the left one, flat
    ((-0.002, -0.030, -0.008), (0.036, 0.026, 0.026), 0.5),  # two small ones below
    ((0.000, 0.032, -0.006), (0.034, 0.024, 0.028), 0.45),
    ((-0.022, -0.006, -0.052), (0.046, 0.044, 0.036), -0.75),  # where stomach and kidney lie
    ((-0.016, -0.058, 0.020), (0.012, 0.030, 0.050), -0.5),  # the notch between the lobes
)
_LEVEL = 0.38  # value of the sum of the lobes on the surface
_MAX_RADIUS = 0.2  # m from the centre
_SMOOTHINGS = 40  # iterations that even out the spacing of the vertices


def organ(subdivisions: int = 4) -> Mesh:
    """Two large lobes and two small ones, flat on the left, hollow below; about 0.2 m wide."""
    direction, faces = icosphere(subdivisions, 1.0)
    neighbours = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    count = np.bincount(neighbours[:, 0], minlength=len(direction))[:, None]
    x = direction * _radius(direction)[:, None]
    for _ in range(_SMOOTHINGS):
        # Move each vertex to the mean of its neighbours, then back to the surface along its ray.
        middle = np.zeros_like(x)
        np.add.at(middle, neighbours[:, 0], x[neighbours[:, 1]])
        direction = 0.5 * (x + middle / count)
        direction /= np.linalg.norm(direction, axis=1, keepdims=True)
        x = direction * _radius(direction)[:, None]
    return x - np.array([0.0, 0.0, x[:, 2].min()]), faces


def _lobes(x: Floats) -> Floats:
    """Sum of the lobes at points, shape (n,)."""
    total = np.zeros(len(x))
    for center, axes, weight in _LOBES:
        off = (x - np.array(center)) / np.array(axes)
        total += weight * np.exp(-np.einsum("ni,ni->n", off, off))
    return total


def _radius(direction: Floats) -> Floats:
    """Distance of the surface from the centre in each direction, by bisection, shape (n,) [m]."""
    near, far = np.zeros(len(direction)), np.full(len(direction), _MAX_RADIUS)
    for _ in range(50):
        middle = 0.5 * (near + far)
        inside = _lobes(direction * middle[:, None]) > _LEVEL
        near, far = np.where(inside, middle, near), np.where(inside, far, middle)
    return near
