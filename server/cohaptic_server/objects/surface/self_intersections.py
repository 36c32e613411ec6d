"""Triangles of one surface that pass through each other.

Two triangles cross when an edge of one goes through the inside of the other (Moeller and
Trumbore's test for a segment). Pairs to test come from trees of triangles of like size, so that
one large triangle does not make neighbours of all small ones. Two in one plane cross when they
cover an area together (the separating axis theorem): a wall that is there twice, a fold flat on
itself. Others that share an edge do not count.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from cohaptic_server.numeric import Floats, Ints, cross

# Barycentric. Files hold 24 bits of a coordinate, and two triangles next to each other in one plane
# may seem to cross by that much.
_MARGIN = 1e-5
_AT_ONCE = 2000
# Of the size of a surface: 24 bits of a coordinate put corners of one plane so far out of it.
_OUT_OF_PLANE = 3e-7
# Of the smaller triangle's height: by less than that neighbours in one plane may overlap.
_COVERED = 0.02
_SLIVER = 1e-3  # height over longest edge, below which a triangle has no plane to speak of


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
    size = float(np.ptp(x, axis=0).max())
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
            gap = middle[i] - middle[j]
            close = np.einsum("pi,pi->p", gap, gap) <= (radius[i] + radius[j]) ** 2
            i, j, common = (which[close & (i != j)] for which in (i, j, common))
            hit = _cover(corners[i], corners[j], _OUT_OF_PLANE * size)
            crossing[i[hit]] = crossing[j[hit]] = True
            i, j, common = (which[common < 2] for which in (i, j, common))
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


def _cover(a: Floats, b: Floats, out: float) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Whether two triangles lie in one plane and cover an area together, shapes (p, 3, 3).

    Args:
        a: Corners of the one.
        b: Of the other.
        out: How far corners of one plane may lie out of it.
    """
    normals, heights = zip(*(_plane(t) for t in (a, b)), strict=True)
    usable = (heights[0] > 0.0) & (heights[1] > 0.0)
    for normal, here, there in ((normals[0], a, b), (normals[1], b, a)):
        off = np.einsum("pci,pi->pc", there - here[:, :1], normal)
        usable &= np.abs(off).max(axis=1) <= out
    hit = np.zeros(len(a), dtype=np.bool_)
    which = np.flatnonzero(usable)
    if not len(which):
        return hit
    a, b, normal = a[which], b[which], normals[0][which]
    least = np.full(len(which), np.inf)
    for triangle in (a, b):
        for k in range(3):
            axis = cross(normal, triangle[:, (k + 1) % 3] - triangle[:, k])
            axis /= np.linalg.norm(axis, axis=1, keepdims=True)
            of_a, of_b = (np.einsum("pci,pi->pc", t, axis) for t in (a, b))
            deep = np.minimum(of_a.max(axis=1), of_b.max(axis=1))
            least = np.minimum(least, deep - np.maximum(of_a.min(axis=1), of_b.min(axis=1)))
    margin = _COVERED * np.minimum(heights[0], heights[1])[which] + 2.0 * out
    hit[which] = least > margin
    return hit


def _plane(corners: Floats) -> tuple[Floats, Floats]:
    """Unit normals, shape (p, 3), and least heights, 0 for slivers, shape (p,)."""
    edges = corners[:, [1, 2, 0]] - corners
    longest = np.sqrt(np.einsum("pci,pci->pc", edges, edges).max(axis=1))
    normal = cross(edges[:, 0], edges[:, 1])
    twice = np.linalg.norm(normal, axis=1)
    height = twice / np.maximum(longest, 1e-300)
    height[height < _SLIVER * longest] = 0.0
    return normal / np.maximum(twice, 1e-300)[:, None], height
