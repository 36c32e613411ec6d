"""Checks of a surface: open or non-manifold edges, self-intersections, components, orientation.

Triangles that intersect each other are counted. Two triangles intersect if an edge of one passes
through the interior of the other (the test of Moeller and Trumbore, for a segment). Candidate pairs
come from one tree for each size class, so that one large triangle does not make candidates of all
small ones. Coplanar triangles intersect if they overlap in an area (separating axis theorem), as in
a duplicated wall or a fold that lies flat on itself. Other pairs that share an edge do not count.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import chain
from typing import Any

import numpy as np
import scipy.sparse as sp
import scipy.sparse.csgraph

from cohaptic.errors import BodyError
from cohaptic_server.mesh.enclosed_volume import volume
from cohaptic_server.numeric import Floats, Ints, Mask, cross

FLAT = 1e-9  # volume over the cube of the size below which a surface encloses practically none


@dataclass(frozen=True, slots=True)
class SurfaceReport:
    """Defects and size of a surface.

    Args:
        open_edges: Number of edges with only one triangle.
        nonmanifold_edges: Number of edges with three or more triangles.
        intersecting: Number of triangles that intersect another one.
        components: Number of connected components.
        volume: Enclosed volume, in cubic units of the file; negative if normals point inwards.
        size: Longest side of the bounding box, in units of the file.
    """

    open_edges: int
    nonmanifold_edges: int
    intersecting: int
    components: int
    volume: float
    size: float

    def problems(self) -> list[str]:
        """A sentence for each defect that prevents filling the surface."""
        problems: list[str] = []
        if self.open_edges:
            problems.append(f"the surface is open: {self.open_edges} edges have one triangle only")
        if self.nonmanifold_edges:
            problems.append(
                f"{self.nonmanifold_edges} edges have three triangles or more; two is right"
            )
        if self.intersecting > 0:
            problems.append(
                f"the surface passes through itself: {self.intersecting} triangles cross"
            )
        return problems

    @property
    def flat(self) -> bool:
        """Whether the surface encloses practically no volume."""
        return abs(self.volume) < FLAT * self.size**3


def examine(x: Floats, faces: Ints) -> SurfaceReport:
    """Check a surface whose vertices have been merged.

    Args:
        x: Vertices, shape (n, 3).
        faces: Triangles, shape (m, 3).
    """
    edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    counts = edge_counts(faces)
    graph = sp.coo_array(
        (np.ones(len(edges), dtype=np.int8), (edges[:, 0], edges[:, 1])), shape=(len(x), len(x))
    )
    components, _ = scipy.sparse.csgraph.connected_components(sp.csr_array(graph), directed=False)
    centred = x - x.mean(axis=0)
    return SurfaceReport(
        open_edges=int((counts == 1).sum()),
        nonmanifold_edges=int((counts > 2).sum()),
        intersecting=count_intersecting(centred, faces),
        components=int(components),
        volume=volume(centred, faces),
        size=float(np.ptp(x, axis=0).max()),
    )


def is_flat(x: Floats, faces: Ints) -> bool:
    """Whether triangles (m, 3) enclose practically no volume for the size of vertices (n, 3)."""
    return abs(volume(x - x.mean(axis=0), faces)) < FLAT * float(np.ptp(x, axis=0).max()) ** 3


def edge_counts(faces: Ints) -> Ints:
    """Number of triangles at each edge, shape (edges,); 2 everywhere in a closed surface."""
    edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    # Sorting one number for each edge is twenty times as fast as sorting pairs.
    _, counts = np.unique(edges[:, 0] * (faces.max() + 1) + edges[:, 1], return_counts=True)
    return np.asarray(counts, dtype=np.int64)


def facing_outwards(x: Floats, faces: Ints) -> Ints:
    """Triangles facing outwards: all are reversed if the surface is inside out; shape (m, 3)."""
    return faces if volume(x - x.mean(axis=0), faces) >= 0.0 else faces[:, [0, 2, 1]]


# Margin in barycentric coordinates. Files store coordinates with 24 bits, and the rounding may make
# coplanar neighbours seem to intersect.
_MARGIN = 1e-5
_PAIRS = 200_000  # pairs of triangles that are tested at once; bounds the memory
_MAX_PAIRS = 5 * 10**7  # a scan of 300,000 triangles has a fifth of that
_COUNTED = 500  # triangles whose pairs are counted at once
# Distance from a common plane that counts as coplanar, as a share of the surface's size: it allows
# for the rounding to 24 bits.
_OUT_OF_PLANE = 3e-7
# Overlap of coplanar neighbours that is tolerated, as a share of the smaller triangle's height.
_OVERLAP = 0.02
_SLIVER = 1e-3  # height over longest edge below which the normal of a triangle is unreliable


def count_intersecting(x: Floats, faces: Ints) -> int:
    """Number of triangles that intersect another one; arguments as for `intersecting`."""
    return int(intersecting(x, faces).sum())


def intersecting(x: Floats, faces: Ints) -> Mask:
    """Whether each triangle intersects another one, shape (m,).

    Args:
        x: Vertices, shape (n, 3).
        faces: Triangles, shape (m, 3).

    Raises:
        BodyError: So many triangles overlap that testing them would not end.
    """
    corners = x[faces]
    center = corners.mean(axis=1)
    radius = np.linalg.norm(corners - center[:, None], axis=2).max(axis=1)
    size_class = np.floor(np.log2(np.maximum(radius, 1e-300))).astype(np.int64)
    intersects = np.zeros(len(faces), dtype=np.bool_)
    size = float(np.ptp(x, axis=0).max())
    slack = _OUT_OF_PLANE * size
    low, high = corners.min(axis=1) - slack, corners.max(axis=1) + slack
    for k in np.unique(size_class).tolist():
        large = np.flatnonzero(size_class == k)
        from scipy.spatial import cKDTree  # imported here for the reason in `mesh/surface.py`

        tree = cKDTree(center[large])
        others = np.flatnonzero(size_class <= k)
        query: Any = tree.query_ball_point  # its return type depends on the argument's shape
        reaches = radius + radius[large].max()
        pairs = _counted(query, center[others], reaches[others])
        blocks = np.arange(_PAIRS, int(pairs[-1]) + _PAIRS, _PAIRS)
        for small in np.split(others, np.unique(np.searchsorted(pairs, blocks))):
            if intersects[large].all():  # then only those that are not known yet matter
                small = small[~intersects[small]]
            if not len(small):
                continue
            near: list[list[int]] = list(query(center[small], reaches[small]))
            counts = np.fromiter(map(len, near), np.int64, len(near))
            i = np.repeat(small, counts)
            j = large[np.fromiter(chain.from_iterable(near), np.int64, len(i))]
            # Each pair is tested once, and none of two triangles that are known to cross others.
            # Bounding boxes rule out nearly all pairs.
            once = ((size_class[i] < k) | (i < j)) & ~(intersects[i] & intersects[j])
            i, j = i[once], j[once]
            for axis in range(3):
                meet = (low[i, axis] <= high[j, axis]) & (low[j, axis] <= high[i, axis])
                i, j = i[meet], j[meet]
            common = (faces[i][:, :, None] == faces[j][:, None, :]).sum(axis=(1, 2))
            hit = _overlap(corners[i], corners[j], slack)
            intersects[i[hit]] = intersects[j[hit]] = True
            i, j, common = (values[common < 2] for values in (i, j, common))
            # Triangles that share a vertex touch there, which is no intersection. For other pairs
            # touching counts, since the halves of a mirrored shape would else not be detected.
            margin = np.where(common == 1, _MARGIN, -1e-4 * _MARGIN)
            hit = _edge_passes(corners[i], corners[j], margin) | _edge_passes(
                corners[j], corners[i], margin
            )
            intersects[i[hit]] = intersects[j[hit]] = True
    return intersects


def _counted(query: Any, centers: Floats, reaches: Floats) -> Ints:
    """Number of triangles near those up to each one, shape (m,).

    Args:
        query: Finds the triangles near some points, or their number.
        centers: Centres of the triangles, shape (m, 3).
        reaches: Distance at which each one is near another, shape (m,).

    Raises:
        BodyError: There are so many that testing them would not end.
    """
    counts = np.zeros(len(centers), dtype=np.int64)
    total = 0
    for start in range(0, len(centers), _COUNTED):  # counting a billion pairs takes a while, too
        some = slice(start, start + _COUNTED)
        counts[some] = query(centers[some], reaches[some], return_length=True)
        total += int(counts[some].sum())
        if total > _MAX_PAIRS:
            raise BodyError(
                f"more than {_MAX_PAIRS:,} pairs of its triangles lie close to each other: they"
                " overlap nearly everywhere, or are needles. Mesh it anew"
            )
    return np.cumsum(counts)


def _edge_passes(a: Floats, b: Floats, low: Floats) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Whether an edge of one triangle passes through the other, for each pair, shape (p,).

    Args:
        a: Corners of the triangles whose edges are tested, shape (p, 3, 3).
        b: Corners of the triangles that they may pass through, shape (p, 3, 3).
        low: Least barycentric coordinate of a point that counts as interior, shape (p,).
    """
    e1, e2 = b[:, 1] - b[:, 0], b[:, 2] - b[:, 0]
    hit = np.zeros(len(a), dtype=np.bool_)
    for k in range(3):
        origin, edge = a[:, k], a[:, (k + 1) % 3] - a[:, k]
        p = cross(edge, e2)
        det = np.einsum("pi,pi->p", e1, p)
        scale = np.sqrt(
            np.einsum("pi,pi->p", e1, e1)
            * np.einsum("pi,pi->p", e2, e2)
            * np.einsum("pi,pi->p", edge, edge)
        )
        usable = np.abs(det) > 1e-6 * scale
        inverse = 1.0 / np.where(usable, det, 1.0)
        s = origin - b[:, 0]
        u = np.einsum("pi,pi->p", s, p) * inverse
        q = cross(s, e1)
        v = np.einsum("pi,pi->p", edge, q) * inverse
        t = np.einsum("pi,pi->p", e2, q) * inverse
        high = 1.0 - low
        hit |= usable & (u > low) & (v > low) & (u + v < high) & (t > low) & (t < high)
    return hit


def _overlap(a: Floats, b: Floats, out: float) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Whether two triangles are coplanar and overlap in an area, for each pair, shape (p,).

    Args:
        a: Corners of the first triangles, shape (p, 3, 3).
        b: Corners of the second triangles, shape (p, 3, 3).
        out: Largest distance from the plane at which a corner counts as coplanar.
    """
    normals, heights = zip(*(_plane(t) for t in (a, b)), strict=True)
    usable = (heights[0] > 0.0) & (heights[1] > 0.0)
    for normal, one, other in ((normals[0], a, b), (normals[1], b, a)):
        off = np.einsum("pci,pi->pc", other - one[:, :1], normal)
        usable &= np.abs(off).max(axis=1) <= out
    hit = np.zeros(len(a), dtype=np.bool_)
    coplanar = np.flatnonzero(usable)
    if not len(coplanar):
        return hit
    a, b, normal = a[coplanar], b[coplanar], normals[0][coplanar]
    depth = np.full(len(coplanar), np.inf)  # least overlap over the axes
    for triangle in (a, b):
        for k in range(3):
            axis = cross(normal, triangle[:, (k + 1) % 3] - triangle[:, k])
            axis /= np.linalg.norm(axis, axis=1, keepdims=True)
            of_a, of_b = (np.einsum("pci,pi->pc", t, axis) for t in (a, b))
            end = np.minimum(of_a.max(axis=1), of_b.max(axis=1))
            depth = np.minimum(depth, end - np.maximum(of_a.min(axis=1), of_b.min(axis=1)))
    margin = _OVERLAP * np.minimum(heights[0], heights[1])[coplanar] + 2.0 * out
    hit[coplanar] = depth > margin
    return hit


def _plane(corners: Floats) -> tuple[Floats, Floats]:
    """Unit normals, shape (p, 3), and least heights of triangles, 0 for slivers, shape (p,)."""
    edges = corners[:, [1, 2, 0]] - corners
    longest = np.sqrt(np.einsum("pci,pci->pc", edges, edges).max(axis=1))
    normal = cross(edges[:, 0], edges[:, 1])
    twice = np.linalg.norm(normal, axis=1)
    height = twice / np.maximum(longest, 1e-300)
    height[height < _SLIVER * longest] = 0.0
    return normal / np.maximum(twice, 1e-300)[:, None], height
