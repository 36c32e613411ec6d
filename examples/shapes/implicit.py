"""The surface of a body of blended limbs, by marching tetrahedra.

Doi and Koide 1991. Each cell of a grid is cut into six tetrahedra about its diagonal; in one whose
corners lie on both sides the surface is a triangle or two. Unlike the table of marching cubes this
has no ambiguous case, so that the surface is always closed and without a branching edge.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from cohaptic_server.numeric import Floats, Ints, cross
from shapes.grids import Mesh

# Nearest that a vertex comes to a node, as a share of the edge: slivers are then rare.
_OFF_NODE = 0.15


class Limb(NamedTuple):
    """A tapered rod with round ends.

    Args:
        start: Middle of the first end [m].
        end: Middle of the second end [m].
        radii: Radius at both ends [m].
        flat: Factor on the distance along y: a limb of 4 is a quarter as thick as wide.
    """

    start: tuple[float, float, float]
    end: tuple[float, float, float]
    radii: tuple[float, float]
    flat: float = 1.0


def blended(limbs: Sequence[Limb], blend: float) -> Callable[[Floats], Floats]:
    """A function that is positive inside limbs that flow into each other.

    Args:
        limbs: The limbs.
        blend: Width over which they flow into each other [m].

    Returns:
        From points (n, 3) [m] to values (n,) [m], a smooth maximum of the depths in all limbs.
    """

    def depth(x: Floats) -> Floats:
        depths: list[Floats] = []
        for limb in limbs:
            stretch = np.array([1.0, limb.flat, 1.0])
            start, end = np.array(limb.start) * stretch, np.array(limb.end) * stretch
            axis, off = end - start, x * stretch - start
            along = np.clip(off @ axis / max(float(axis @ axis), 1e-12), 0.0, 1.0)
            radius = limb.radii[0] + (limb.radii[1] - limb.radii[0]) * along
            gap = np.linalg.norm(off - along[:, None] * axis, axis=1)
            depths.append((radius - gap) / limb.flat)
        return np.asarray(blend * np.logaddexp.reduce(np.array(depths) / blend, axis=0))

    return depth


def surface(inside: Callable[[Floats], Floats], low: Floats, high: Floats, cell: float) -> Mesh:
    """The closed surface on which a function is zero, facing where it is negative.

    Args:
        inside: Positive inside, negative at every side of the box; points (n, 3) to values (n,).
        low: Lowest corner of a box round the surface, shape (3,) [m].
        high: Highest corner of the box, shape (3,) [m].
        cell: Edge of a cell of the grid [m].
    """
    shape: list[int] = (np.ceil((high - low) / cell).astype(np.int64) + 1).tolist()
    number = np.arange(shape[0] * shape[1] * shape[2])
    nodes = low + cell * np.stack(np.unravel_index(number, shape), axis=1)
    value = inside(nodes)
    steps = (shape[1] * shape[2], shape[2], 1)
    first = number.reshape(shape)[:-1, :-1, :-1].ravel()
    tets: list[Ints] = []
    for order in itertools.permutations(steps):
        path = np.cumsum([0, *order])
        tets.append(first[:, None] + path)
    corners = np.concatenate(tets)
    count = (value[corners] > 0.0).sum(axis=1)
    # Corners inside come first.
    cut = corners[(count > 0) & (count < 4)]
    cut = np.take_along_axis(cut, np.argsort(value[cut] <= 0.0, axis=1, kind="stable"), axis=1)
    count = (value[cut] > 0.0).sum(axis=1)
    triangles = np.concatenate(
        [
            cut[count == 1][:, [[0, 1], [0, 2], [0, 3]]],
            cut[count == 3][:, [[0, 3], [1, 3], [2, 3]]],
            cut[count == 2][:, [[0, 2], [0, 3], [1, 3]]],
            cut[count == 2][:, [[0, 2], [1, 3], [1, 2]]],
        ]
    )  # each corner is an edge of the grid, from a node inside to one outside
    edges, number = np.unique(triangles.reshape(-1, 2), axis=0, return_inverse=True)
    faces = np.asarray(number).reshape(-1, 3)
    a, b = edges.T
    fraction = np.clip(value[a] / (value[a] - value[b]), _OFF_NODE, 1.0 - _OFF_NODE)[:, None]
    x = (1.0 - fraction) * nodes[a] + fraction * nodes[b]
    p, q, r = (x[faces[:, k]] for k in range(3))
    out = (nodes[b] - nodes[a])[faces].sum(axis=1)
    wrong = np.einsum("mi,mi->m", cross(q - p, r - p), out) < 0.0
    faces[wrong] = faces[wrong][:, ::-1]
    return x, faces
