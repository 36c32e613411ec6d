"""Measures the thickness of a body under its surface, and refines the mesh of thin parts.

`is_smooth` finds the vertices that lie away from sharp edges.

Tetrahedra become finer where a body is thin and bends more than it is squeezed. A mesher fills a
plate with one layer of elements, whose edges along the plate are as long as those of a bulky body
or longer. Few elements suffice for squeezing. For bending they do not: the deflection of a plate is
cubic between two supports, and quadratic elements cannot follow a cubic, so that the plate is too
stiff by two terms (docs/design/solid.md):

    63 % (h / R)^2 (1 + (h / t)^2 / 22)

with edges up to h, on a clamped plate of radius R and thickness t. The first term is the curvature
that changes within an element. The second term is the shear that an element far longer than it is
thick cannot avoid as it bends, so that thin sheets need still shorter edges.

Edges become shorter in chosen places by bisection of longest edges (Rivara 1984). An edge is split
in its middle, in all tetrahedra round it, as soon as it is the longest edge of each of them; longer
edges of these tetrahedra are split before it. Neighbours conform after each split, and elements
become flatter by no more than a bounded factor. In a layer one element thick the edges along the
layer are split and not those through its thickness, which are shorter.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from cohaptic_server.mesh.surface import SurfaceMesh, face_area_vectors
from cohaptic_server.mesh.tetrahedra import EDGES, TetMesh, boundary
from cohaptic_server.numeric import Floats, Ints, Mask

_ROUND = 1e-9  # rounding of barycentric coordinates, and of distances over the body's size
_SMOOTH = 0.82  # cosine of 35 degrees, between the normals of a vertex and of a face


def depth_under(mesh: SurfaceMesh, vertices: Ints) -> Floats:
    """Return the depth under each vertex at which another side of the body is as near, (k,) [m].

    In a plate this depth is half of the thickness; in a tube or a ball, the radius. Where another
    side is nearer already at a fiftieth of the body's size, the depth is half of the thickness
    straight below, at most that fiftieth.

    Args:
        vertices: Vertices under which the depth is measured, shape (k,).
    """
    steps = mesh.size * np.linspace(0.02, 1.0, 50)
    inner = mesh.vertices[vertices][:, None] - steps[:, None] * mesh.normals[vertices][:, None]
    nearest = np.asarray(mesh.quadrature.tree.query(inner)[0])
    # The nearest quadrature point lies beside the vertex: the margin allows for that.
    own = nearest >= 0.9 * steps - 0.1 * mesh.size / len(mesh.vertices) ** 0.5
    deep = np.where(np.logical_and.accumulate(own, axis=1), steps, 0.0).max(axis=1)
    thin = np.flatnonzero(deep == 0.0)
    deep[thin] = np.minimum(0.5 * thickness(mesh, vertices[thin]), steps[0])
    return np.asarray(deep)


def thickness(mesh: SurfaceMesh, vertices: Ints) -> Floats:
    """Return the distance from each vertex through the body to the other side, shape (k,) [m].

    A ray enters the body against the vertex's normal, and leaves through the nearest triangle that
    the ray meets from inside (Moeller, Trumbore 1997). Where it meets none, the thickness is
    infinite.

    Args:
        vertices: Vertices at which the rays enter, shape (k,).
    """
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    u, v = b - a, c - a
    found = np.full(len(vertices), np.inf)
    for k, vertex in enumerate(vertices.tolist()):
        along = -mesh.normals[vertex]
        p = np.cross(along, v)
        det = np.einsum("fi,fi->f", u, p)
        # A ray from inside has the direction of the outward normal of the triangle that it meets.
        out = np.flatnonzero(det < 0.0)
        offset = mesh.vertices[vertex] - a[out]
        s = np.einsum("fi,fi->f", offset, p[out]) / det[out]
        q = np.cross(offset, u[out])
        t = (q @ along) / det[out]
        far = np.einsum("fi,fi->f", v[out], q) / det[out]
        hit = (s >= -_ROUND) & (t >= -_ROUND) & (s + t <= 1.0 + _ROUND) & (far > _ROUND * mesh.size)
        found[k] = far[hit].min(initial=np.inf)
    return found


def is_smooth(mesh: SurfaceMesh) -> Mask:
    """Find the vertices that lie away from sharp edges and tips: a mask of shape (n,).

    The normals of all faces round such a vertex are within 35 degrees of the vertex's normal.
    """
    areas = face_area_vectors(mesh.vertices, mesh.faces)
    normals = areas / np.maximum(np.linalg.norm(areas, axis=1, keepdims=True), 1e-300)
    along = np.einsum("fci,fi->fc", mesh.normals[mesh.faces], normals)
    least = np.ones(len(mesh.vertices))
    np.minimum.at(least, mesh.faces.ravel(), along.ravel())
    return np.asarray(least > _SMOOTH)


# Largest thickness of a thin part, and longest edge in it, both over the requested edge length.
# fTetWild's own edges are up to 1.9 times as long as asked for.
THIN, SHORT = 1.5, 0.75
# Multiple of the thickness `THIN` up to which edges grow with the thickness of a part: at twice
# `THIN` they are as long as fTetWild's own, and a shorter `--edge` never gives a coarser plate.
FADES = 2.0
_LOCKS = 1.0 / 22.0  # factor of (h / t)^2 in the second term, over the first term
_SHORTEST = 0.35  # least edge as a share of `SHORT`, as the tip of a wedge has no thickness
_OPPOSED = -0.5  # cosine of 120 degrees, between the normals of the two sides
# Largest distance between the middles of two opposed faces, over the thickness or over `THIN` edge
# lengths if that is more: one middle may lie half an edge beside the point opposite the other.
_BESIDE = 1.1
_BATCH = 256  # faces whose neighbours one search finds: 100 MB where all are neighbours


def finer_where_thin(tets: TetMesh, length: float, limit: int) -> Bisected:
    """Split the long edges of thin parts.

    Args:
        tets: Mesh of the object.
        length: Edge length that was asked for [m].
        limit: Largest number of tetrahedra; an object that already has as many is not split.
    """
    thickness = np.full(len(tets.vertices), np.inf)
    if len(tets.tets) < limit:
        thickness = layer_thickness(tets.vertices, boundary(tets.tets), FADES * THIN * length)
    return with_shorter_edges(tets, longest_wanted(thickness, length), limit)


def longest_wanted(thickness: Floats, length: float) -> Floats:
    """Return the longest edge with which a part bends accurately enough, shape (n,) [m].

    The error of a thin part is that of an edge of `SHORT` times `length` on a part many times
    thicker than the edge is long.

    Args:
        thickness: Thickness of the part at each vertex, shape (n,) [m]; infinite where a part is
            not thin.
        length: Edge length that was asked for [m].
    """
    thin, wanted = np.isfinite(thickness), np.full(len(thickness), np.inf)
    t = thickness[thin]
    largest = SHORT * length * np.maximum(1.0, t / (THIN * length))
    locks = 4.0 * _LOCKS * (largest / np.maximum(t, 1e-9 * length)) ** 2
    # The root h of h^2 (1 + locks h^2 / (4 most^2)) = most^2.
    h = largest * np.sqrt(2.0 / (1.0 + np.sqrt(1.0 + locks)))
    wanted[thin] = np.maximum(h, _SHORTEST * SHORT * length)
    return wanted


def layer_thickness(x: Floats, faces: Ints, limit: float) -> Floats:
    """Return the thickness of a body at each vertex of its thin parts, shape (n,) [m].

    Args:
        x: Positions of the vertices, shape (n, 3) [m].
        faces: Faces of the surface, counter-clockwise from outside, shape (m, 3).
        limit: Largest thickness of a thin part, along the normal of a face [m].

    Returns:
        The thickness; infinite where the other side is further than `limit`, and inside the body.
    """
    from scipy.spatial import cKDTree  # takes 0.3 s, and only preparing an object needs it

    areas = face_area_vectors(x, faces)
    normals = areas / np.maximum(np.linalg.norm(areas, axis=1, keepdims=True), 1e-300)
    middles = x[faces].mean(axis=1)
    tree, least = cKDTree(middles), np.full(len(faces), np.inf)
    for start in range(0, len(faces), _BATCH):
        some = cKDTree(middles[start : start + _BATCH])
        pairs = some.sparse_distance_matrix(tree, _BESIDE * limit, output_type="ndarray")
        a, b = pairs["i"] + start, pairs["j"]
        opposed = np.einsum("pi,pi->p", normals[a], normals[b]) < _OPPOSED
        a, b = a[opposed], b[opposed]
        # Distance from one face to the other against its normal; if negative, a narrow gap lies
        # between them.
        across = np.einsum("pi,pi->p", middles[a] - middles[b], normals[a])
        behind = (across > 0.0) & (across <= limit)
        behind &= pairs["v"][opposed] <= _BESIDE * np.maximum(across, limit / FADES)
        np.minimum.at(least, a[behind], across[behind])
    found = np.full(len(x), np.inf)
    np.minimum.at(found, faces.ravel(), np.repeat(least, 3))
    return found


_EDGES = np.array(EDGES)
_SHRINK = 0.9  # ratio of successive excesses; each level's edges are split before shorter ones
_MAX_PASSES = 100  # passes for one excess; plates, rods and bowls took at most 8


@dataclass(frozen=True, eq=False)
class Bisected:
    """A mesh of tetrahedra after some of its edges were split.

    Args:
        tets: Mesh after the splits; vertices of the original mesh come first, in their order.
        parent: Index of the original tetrahedron that contains each tetrahedron, shape (m,).
        wanted: Longest edge that is wanted at each vertex, infinite where any length will do, shape
            (n,) [m]. The wanted length of an edge is the longer of those at its ends.
        excess: Upper bound of the ratio of an edge's length to its wanted length: 1 if all edges
            could be split, more if the limit on tetrahedra ended the splitting, less if no edge had
            to be split.
    """

    tets: TetMesh
    parent: Ints
    wanted: Floats
    excess: float


def with_shorter_edges(tets: TetMesh, wanted: Floats, limit: int) -> Bisected:
    """Split edges until none is longer than its wanted length: the longer of those at its ends.

    Args:
        tets: Mesh of the object.
        wanted: Longest edge at each vertex, shape (n,) [m]; infinite where any length will do. The
            middle of a split edge gets the mean of the lengths at its ends.
        limit: Largest number of tetrahedra. The bound on edges falls step by step to the wanted
            lengths, and stays at the last step that this number allows.
    """
    start = longest_over_wanted(tets, wanted)
    now = Bisected(tets, np.arange(len(tets.tets), dtype=np.int64), wanted, start)
    steps = math.ceil(math.log(start) / -math.log(_SHRINK)) if start > 1.0 else 0
    for step in range(1, steps + 1):
        after = _split_to(now, max(1.0, start * _SHRINK**step), limit)
        if after is None:
            break
        now = after
    return now


def longest_over_wanted(tets: TetMesh, wanted: Floats) -> float:
    """Return the largest ratio of an edge's length to its wanted length; 0 if any will do.

    Args:
        wanted: As for `with_shorter_edges`.
    """
    edges = tets.tets[:, _EDGES].reshape(-1, 2)
    along = tets.vertices[edges[:, 1]] - tets.vertices[edges[:, 0]]
    ratio = np.linalg.norm(along, axis=1) / wanted[edges].max(axis=1)
    return float(ratio.max(initial=0.0))


def _split_to(mesh: Bisected, excess: float, limit: int) -> Bisected | None:
    """Split edges over `excess` times their wanted length; None for over `limit` tetrahedra."""
    for _ in range(_MAX_PASSES):
        after = _split_once(mesh, excess)
        if after is None:
            break
        if len(after.parent) > limit:
            return None
        mesh = after
    return Bisected(mesh.tets, mesh.parent, mesh.wanted, excess)


def _split_once(mesh: Bisected, excess: float) -> Bisected | None:
    """Split once every edge that must be split and is the longest edge of all its tetrahedra.

    Returns:
        The mesh after these splits; None if there was no such edge.
    """
    x, t = mesh.tets.vertices, mesh.tets.tets
    pairs = np.sort(t[:, _EDGES].reshape(-1, 2), axis=1)
    numbers, first, of = np.unique(
        pairs[:, 0] * len(x) + pairs[:, 1], return_index=True, return_inverse=True
    )
    edges, of = pairs[first], of.reshape(-1, 6)
    lengths = np.linalg.norm(x[edges[:, 1]] - x[edges[:, 0]], axis=1)
    # Edges of equal length are ordered too, alike in all tetrahedra, so that one is the longest.
    rank = np.empty(len(numbers), dtype=np.int64)
    rank[np.argsort(lengths, kind="stable")] = np.arange(len(numbers))
    place = rank[of].argmax(axis=1)
    longest = of[np.arange(len(t)), place]
    split = _on_the_way(of, longest, lengths > excess * mesh.wanted[edges].max(axis=1))
    split &= np.bincount(longest, minlength=len(numbers)) == np.bincount(of.ravel())
    if not split.any():
        return None
    middle = len(x) + np.cumsum(split) - 1
    hit = split[longest]
    rows, ends = np.arange(int(hit.sum())), _EDGES[place[hit]]
    halves = [t[hit], t[hit]]
    for half, end in zip(halves, ends.T, strict=True):
        half[rows, end] = middle[longest[hit]]
    new = np.concatenate([x, x[edges[split]].mean(axis=1)])
    parent = np.concatenate([mesh.parent[~hit], mesh.parent[hit], mesh.parent[hit]])
    wanted = np.concatenate([mesh.wanted, mesh.wanted[edges[split]].mean(axis=1)])
    finer = replace(mesh.tets, vertices=new, tets=np.concatenate([t[~hit], *halves]))
    return Bisected(finer, parent, wanted, mesh.excess)


def _on_the_way(of: Ints, longest: Ints, over: Mask) -> Mask:
    """Find the edges that have to be split before all overlong ones can be: a mask, shape (e,).

    They are the longest edges of certain tetrahedra: of those with an overlong edge, and of those
    that contain the longest edge of another one of these tetrahedra.

    Args:
        of: Edges of each tetrahedron, shape (m, 6).
        longest: Longest edge of each tetrahedron, shape (m,).
        over: Whether an edge is overlong, that is over its wanted length, shape (e,).
    """
    needed = over[of].any(axis=1)
    while True:
        found = np.zeros(len(over), dtype=np.bool_)
        found[longest[needed]] = True
        further = found[of].any(axis=1)
        if not (further & ~needed).any():
            return found
        needed |= further
