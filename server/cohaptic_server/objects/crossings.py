"""Triangles of one surface that pass through each other.

Two triangles cross when an edge of one goes through the inside of the other (Moeller and
Trumbore's test for a segment). Pairs to test come from trees of triangles of like size, so that
one large triangle does not make neighbours of all small ones. Triangles that share an edge, or lie
in one plane, do not count.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from cohaptic_server.bodies.mesh import Floats, Ints, cross

# Barycentric. Files hold 24 bits of a coordinate, and two triangles next to each other in one plane
# may seem to cross by that much.
_MARGIN = 1e-5
_AT_ONCE = 2000


def count_crossings(x: Floats, faces: Ints) -> int:
    """How many triangles cross another one.

    Args:
        x: Shape (n, 3).
        faces: Shape (m, 3).
    """
    corners = x[faces]
    middle = corners.mean(axis=1)
    radius = np.linalg.norm(corners - middle[:, None], axis=2).max(axis=1)
    klass = np.floor(np.log2(np.maximum(radius, 1e-300))).astype(np.int64)
    crossing = np.zeros(len(faces), dtype=np.bool_)
    for k in np.unique(klass).tolist():
        large = np.flatnonzero(klass == k)
        tree = cKDTree(middle[large])
        others = np.flatnonzero(klass <= k)
        for start in range(0, len(others), _AT_ONCE):
            small = others[start : start + _AT_ONCE]
            reach = radius[small] + radius[large].max()
            query: Any = tree.query_ball_point  # its type depends on the shape of what it gets
            near: list[list[int]] = list(query(middle[small], reach))
            counts = np.array([len(found) for found in near])
            if not counts.sum():
                continue
            i = np.repeat(small, counts)
            j = large[np.concatenate([np.array(found, dtype=np.int64) for found in near])]
            common = (faces[i][:, :, None] == faces[j][:, None, :]).sum(axis=(1, 2))
            apart = common < 2
            gap = middle[i] - middle[j]
            close = np.einsum("pi,pi->p", gap, gap) <= (radius[i] + radius[j]) ** 2
            i, j, common = (which[apart & close] for which in (i, j, common))
            # Two that have a corner in common touch there; of others touching is crossing, or the
            # two halves of a mirrored shape, whose edges meet in the mirror, would pass.
            margin = np.where(common == 1, _MARGIN, -1e-4 * _MARGIN)
            hit = _cross(corners[i], corners[j], margin) | _cross(corners[j], corners[i], margin)
            crossing[i[hit]] = crossing[j[hit]] = True
    return int(crossing.sum())


def _cross(a: Floats, b: Floats, low: Floats) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Whether an edge of a goes through b, pair by pair; shapes (p, 3, 3), margin `low` (p,)."""
    e1, e2 = b[:, 1] - b[:, 0], b[:, 2] - b[:, 0]
    hit = np.zeros(len(a), dtype=np.bool_)
    for k in range(3):
        origin, way = a[:, k], a[:, (k + 1) % 3] - a[:, k]
        p = cross(way, e2)
        det = np.einsum("pi,pi->p", e1, p)
        scale = np.sqrt(
            np.einsum("pi,pi->p", e1, e1)
            * np.einsum("pi,pi->p", e2, e2)
            * np.einsum("pi,pi->p", way, way)
        )
        usable = np.abs(det) > 1e-6 * scale
        inverse = 1.0 / np.where(usable, det, 1.0)
        s = origin - b[:, 0]
        u = np.einsum("pi,pi->p", s, p) * inverse
        q = cross(s, e1)
        v = np.einsum("pi,pi->p", way, q) * inverse
        t = np.einsum("pi,pi->p", e2, q) * inverse
        high = 1.0 - low
        hit |= usable & (u > low) & (v > low) & (u + v < high) & (t > low) & (t < high)
    return hit
