"""Tetrahedral mesh of a ring of soft tissue, of any resolution: fine outside, coarse inside.

Most vertices lie on the surface, where users touch; each layer below has half as many vertices.
Tests and benchmarks apply loads to the ring, as to the meshes of `blocks.py`.
"""

from __future__ import annotations

import numpy as np

from cohaptic_server.mesh.tetrahedra import TetMesh
from cohaptic_server.numeric import Floats, Ints, Mask

RING, TUBE = 0.06, 0.025  # m; radius of the ring's centre line, and of the tube
FOOT = -0.9 * TUBE  # m; vertices below this height stand on a table and are fixed

_FLATNESS = 0.7  # ratio of the depth of a layer to the width of its cells
_CORE = 6  # vertices round the innermost tube


def ring(along: int, across: int) -> TetMesh:
    """Make a tetrahedral mesh of a solid torus about the z axis.

    Args:
        along: Number of vertices of the surface along the ring.
        across: Number of vertices of the surface round the tube.
    """
    n, m, radius = along, across, TUBE
    above = np.arange(n * m).reshape(n, m)
    points, tets, count = [_torus(n, m, radius)], list[Ints](), n * m
    while m > _CORE:
        long, wide = 2.0 * np.pi * RING / n, 2.0 * np.pi * radius / m
        radius -= _FLATNESS * (long * wide) ** 0.5
        turn = wide < long or n % 2 == 1  # halve where vertices are closer together
        n, m = (n, m // 2) if turn else (n // 2, m)
        below = count + np.arange(n * m).reshape(n, m)
        points.append(_torus(n, m, radius))
        tets += _halved(above.T, below.T) if turn else _halved(above, below)
        above, count = below, count + n * m
    points.append(_torus(n, 1, 0.0))
    middle = np.repeat(count + np.arange(n)[None], m, axis=0)
    tets += _prisms(above.T, np.roll(above.T, -1, axis=0), middle)
    return TetMesh.checked(np.concatenate(points), np.concatenate(tets))


def fixed(mesh: TetMesh) -> Mask:
    """Find the vertices that stand on the table and are fixed: a mask of shape (n,)."""
    return np.asarray(mesh.vertices[:, 2] < FOOT)


def _torus(n: int, m: int, radius: float) -> Floats:
    """Return the points of a torus, n along the ring by m round the tube, shape (n m, 3) [m]."""
    u, v = np.meshgrid(
        2.0 * np.pi * np.arange(n) / n, 2.0 * np.pi * np.arange(m) / m, indexing="ij"
    )
    out = RING + radius * np.cos(v)
    points = np.stack([out * np.cos(u), out * np.sin(u), radius * np.sin(v)], axis=-1)
    return np.asarray(points.reshape(-1, 3))


def _halved(above: Ints, below: Ints) -> list[Ints]:
    """Return tetrahedra between two layers of vertices, both periodic.

    The upper layer has the shape (2 k, l); the lower one has half as many rows, (k, l).
    """
    a, b, c = above[0::2], above[1::2], np.roll(above[0::2], -1, axis=0)
    d, e = below, np.roll(below, -1, axis=0)
    return [*_prisms(a, d, b), *_prisms(d, b, e), *_prisms(b, c, e)]


def _prisms(a: Ints, b: Ints, c: Ints) -> list[Ints]:
    """Return the tetrahedra of prisms between successive triangles, periodic along axis 1.

    The corners `a`, `b` and `c` of the triangles have the shape (k, l). Each side of a prism is cut
    from its earlier corner to the later corner of the next triangle. The corners have one order
    everywhere (along rows, then down), so that neighbours cut a common side alike.
    """
    d, e, f = (np.roll(p, -1, axis=1) for p in (a, b, c))
    quads = ((a, b, c, f), (a, b, e, f), (a, d, e, f))
    return [np.stack(quad, axis=-1).reshape(-1, 4) for quad in quads]
