"""An immutable closed triangle surface, with its normals, pressures and searches.

`pressure` distributes a fingertip's force over vertices, `spread_over` chooses an evenly spread
subset of points, and `NearTree` finds all points within a radius of a given one.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from cohaptic.errors import BodyError
from cohaptic.vec import ZERO, Vec3
from cohaptic_server.mesh.search.contact_search import ContactSearch
from cohaptic_server.mesh.search.loaded_field import LoadedField
from cohaptic_server.mesh.search.nearest_search import NearestSearch
from cohaptic_server.mesh.search.point_tree import PointTree
from cohaptic_server.mesh.search.pressure_search import PressureSearch
from cohaptic_server.numeric import Floats, Ints, cross

# Functions that need scipy's tree import it: that takes 0.3 s, and a running server does without.
if TYPE_CHECKING:
    from scipy.spatial import cKDTree


# Each face has SPLIT^2 quadrature points, so that the weights of a sliding contact change smoothly.
# On a mesh of more than FINE faces a contact covers so many that their centroids suffice.
SPLIT = 3
FINE = 10_000


@dataclass(frozen=True, eq=False)
class Quadrature:
    """Points spread evenly over a surface, since the edge of a pressure lies between vertices.

    Args:
        points: Positions of the points, shape (q, 3) [m].
        areas: Area that each point represents, shape (q,) [m^2].
        vertices: Corners of each point's face, shape (q, 3).
        fractions: Barycentric coordinates of each point, shape (q, 3).
        outward: Unit normal of each point's face, shape (q, 3).
    """

    points: Floats
    areas: Floats
    vertices: Ints
    fractions: Floats
    outward: Floats

    @cached_property
    def tree(self) -> cKDTree:
        """Search tree over `points`, for queries about many points in one call."""
        from scipy.spatial import cKDTree

        return cKDTree(self.points)


@dataclass(frozen=True, eq=False)
class Search:
    """The search for contacts on a surface, and the arrays to which it writes a contact.

    Args:
        search: Contact search, which holds the contact that was found last.
        near: Search for the point of the resting surface nearest to a given point.
        field: Displacement field that the contact search reads.
        frame: Foot, contact point and normal of the contact, shape (3, 3).
        under: Vertices under the contact's pressure, shape (n,); the first `search.count` entries
            are valid.
        weights: Share of each of these vertices in the force, shape (n,).
        place: Array for the displaced contact point that `search.put` computes, shape (3,) [m].
    """

    search: ContactSearch
    near: NearestSearch
    field: LoadedField
    frame: Floats
    under: Ints
    weights: Floats
    place: Floats


@dataclass(frozen=True, eq=False)
class SurfaceMesh:
    """Vertices and faces of a resting surface, and quantities derived from them.

    Args:
        vertices: Resting positions, shape (n, 3) [m].
        faces: Indices into `vertices`, counter-clockwise seen from outside, shape (m, 3).
        origin: Origin of the mesh's frame, as a point of the scaled file of the body [m].

    Attributes:
        rings: Faces round each vertex; short rows repeat their first face, shape (n, valence).
        around: Faces that share a vertex with each face, the face itself included; some faces are
            repeated, shape (m, 3 valence).
        quadrature: Quadrature points on the faces.
        normals: Outward unit normal of each vertex, shape (n, 3).
        split: Square root of the number of quadrature points of a face.
        size: Radius of the sphere of the same area [m].
    """

    vertices: Floats
    faces: Ints
    origin: Vec3 = ZERO
    rings: Ints = field(init=False)
    around: Ints = field(init=False)
    quadrature: Quadrature = field(init=False)
    normals: Floats = field(init=False)
    split: int = field(init=False)
    size: float = field(init=False)

    def __post_init__(self) -> None:
        x, faces = self.vertices, self.faces
        if x.ndim != 2 or x.shape[1] != 3 or faces.ndim != 2 or faces.shape[1] != 3:
            raise BodyError(f"a surface needs (n, 3) vertices and faces: {x.shape}, {faces.shape}")
        object.__setattr__(self, "rings", _rings(faces, len(x)))
        object.__setattr__(self, "around", self.rings[faces].reshape(len(faces), -1))
        object.__setattr__(self, "split", SPLIT if len(faces) <= FINE else 1)
        object.__setattr__(self, "quadrature", _quadrature(x, faces, self.split))
        object.__setattr__(self, "normals", vertex_normals(x, faces))
        area = float(self.quadrature.areas.sum())
        object.__setattr__(self, "size", (area / (4.0 * np.pi)) ** 0.5)
        for array in (x, faces, self.rings, self.around, self.normals):
            array.setflags(write=False)

    @cached_property
    def tree(self) -> cKDTree:
        """Search tree over `vertices`, for queries about many points in one call."""
        from scipy.spatial import cKDTree

        return cKDTree(self.vertices)

    @cached_property
    def near_tree(self) -> NearTree:
        """Search for the vertices near one given point."""
        return NearTree(self.vertices)

    @cached_property
    def contacts(self) -> Search:
        """Search for contacts on this surface, with the arrays of its result."""
        q = self.quadrature
        frame, n = np.zeros((3, 3)), len(self.vertices)
        under, weights = np.zeros(n, dtype=np.int64), np.zeros(n)
        tree = point_tree(q.points)
        order = np.asarray(tree.order)
        field = LoadedField(n)
        near = NearestSearch(self.vertices, self.faces, self.around, tree, self.split**2)
        search = ContactSearch(
            self.vertices,
            self.normals,
            self.faces,
            self.rings,
            near,
            field,
            PressureSearch(
                tree,
                q.areas[order],
                q.vertices[order],
                q.fractions[order],
                q.outward[order],
                under,
                weights,
            ),
            self.size,
            frame,
            under,
            weights,
        )
        return Search(search, near, field, frame, under, weights, np.zeros(3))

    def spacing(self, count: int | None = None) -> float:
        """Return the mean distance between neighbours if vertices are evenly spread [m].

        Args:
            count: Number of vertices; None for the number of vertices of this mesh.
        """
        if count is None:
            return self._own_spacing
        return float(self.size * (4.0 * np.pi / count) ** 0.5)

    @cached_property
    def _own_spacing(self) -> float:
        return self.spacing(len(self.vertices))

    def near(self, point: Floats, radius: float) -> Ints:
        """Return the vertices of the resting surface near a point, in rising order, shape (k,).

        Args:
            point: Centre of the search, shape (3,) [m].
            radius: Largest distance of a vertex from this point [m].
        """
        return self.near_tree.near(point, radius)


def face_area_vectors(x: Floats, faces: Ints) -> Floats:
    """Return the unit normal of each face, multiplied by the face's area, shape (m, 3) [m^2].

    Args:
        x: Positions of the vertices, shape (n, 3) [m].
        faces: Vertices of each face, shape (m, 3).
    """
    a, b, c = x[faces[:, 0]], x[faces[:, 1]], x[faces[:, 2]]
    return 0.5 * cross(b - a, c - a)


def vertex_normals(x: Floats, faces: Ints) -> Floats:
    """Return the unit normal of each vertex, shape (n, 3); arguments as for `face_area_vectors`.

    The normal is the direction of a sum over the faces at the vertex: each face's area vector over
    the squared lengths of the two edges that meet at the vertex. On a sphere the normal is exact
    for any triangles (Max 1999).
    """
    corners = x[faces]  # (m, 3, 3)
    edges = corners[:, [1, 2, 0]] - corners  # from each corner to the next
    squares = np.einsum("mci,mci->mc", edges, edges)
    both = squares * squares[:, [2, 0, 1]]
    vectors = cross(edges[:, 0], -edges[:, 2])
    normals = np.zeros_like(x)
    for corner in range(3):
        np.add.at(normals, faces[:, corner], vectors / both[:, [corner]])
    return np.asarray(normals / np.linalg.norm(normals, axis=1, keepdims=True))


def _rings(faces: Ints, n: int) -> Ints:
    """Return the faces round each vertex; short rows repeat their first face, (n, valence)."""
    order = np.argsort(faces.ravel(), kind="stable")
    counts = np.bincount(faces.ravel(), minlength=n)
    if counts.min(initial=1) == 0:
        raise BodyError(f"vertex {int(counts.argmin())} belongs to no face")
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
    column: Ints = np.arange(int(counts.max()), dtype=np.int64)
    where = starts[:, None] + np.where(column[None, :] < counts[:, None], column[None, :], 0)
    return np.asarray(order[where] // 3, dtype=np.int64)


def _quadrature(x: Floats, faces: Ints, split: int) -> Quadrature:
    """Return quadrature points: the centroids of split^2 equal triangles in each face."""
    fractions: list[tuple[float, float, float]] = []
    for i in range(split):
        for j in range(split - i):
            up = np.array([i + 1 / 3, j + 1 / 3])
            fractions.append((*up / split, 1 - up.sum() / split))
            if i + j < split - 1:
                down = np.array([i + 2 / 3, j + 2 / 3])
                fractions.append((*down / split, 1 - down.sum() / split))
    table = np.array(fractions)  # (split^2, 3)
    points = np.einsum("sk,mki->msi", table, x[faces]).reshape(-1, 3)
    vectors = face_area_vectors(x, faces)
    lengths = np.linalg.norm(vectors, axis=1)
    return Quadrature(
        points,
        np.repeat(lengths / len(table), len(table)),
        np.repeat(faces, len(table), axis=0),
        np.tile(table, (len(faces), 1)),
        np.repeat(vectors / np.maximum(lengths, 1e-300)[:, None], len(table), axis=0),
    )


def pressure(
    mesh: SurfaceMesh, point: Floats, radius: float, normal: Floats | None = None
) -> tuple[Ints, Floats]:
    """Distribute the force of a fingertip over the vertices round a point.

    The pressure has the profile of `PressureSearch.spread`.

    Args:
        mesh: Resting surface.
        point: Centre of the pressure, shape (3,) [m].
        radius: Contact radius [m].
        normal: Outward unit normal of the finger, shape (3,), to press only the finger's side of a
            thin part; None to press all sides.

    Returns:
        Vertices under the pressure, shape (k,), and the share of the force on each, shape (k,); the
        shares sum to 1.
    """
    found = mesh.contacts
    found.frame[0] = point
    found.frame[2] = 0.0 if normal is None else normal
    found.search.press(radius)
    count = found.search.count
    return found.under[:count].copy(), found.weights[:count].copy()


def spread_over(points: Floats, count: int) -> Ints:
    """Choose evenly spread points: each is the farthest from all points chosen before.

    Args:
        points: Positions to choose from, shape (n, 3) [m].
        count: Largest number of points.

    Returns:
        Indices of the chosen points, shape (min(n, count),).
    """
    if len(points) <= count:
        return np.arange(len(points), dtype=np.int64)
    chosen = [int(np.argmin(points[:, 0]))]
    gap = np.full(len(points), np.inf)
    while len(chosen) < count:
        off = points - points[chosen[-1]]
        gap = np.minimum(gap, np.einsum("ni,ni->n", off, off))
        chosen.append(int(gap.argmax()))
    return np.array(chosen, dtype=np.int64)


LEAF = 8  # points in a leaf: with fewer, more boxes are compared; with more, more distances


class NearTree:
    """Finds all points that lie within a radius of a given point.

    Args:
        points: Positions of the points, shape (n, 3), n at least 1 [m].

    Attributes:
        tree: Tree of the points.
        found: Scratch memory for indices of points, shape (n,).
    """

    def __init__(self, points: Floats) -> None:
        self.tree = point_tree(points)
        self.found = np.zeros(len(points), dtype=np.int64)

    def near(self, point: Floats, radius: float) -> Ints:
        """Return the indices of the points near a given point, in rising order, shape (k,).

        Args:
            point: Centre of the search, shape (3,) [m].
            radius: Largest distance from this centre [m].
        """
        x, y, z = point.tolist()
        count = self.tree.within(x, y, z, radius, self.found)
        return np.sort(self.found[:count])


def point_tree(points: Floats) -> PointTree:
    """Build a tree of bounding boxes over points, shape (n, 3), n at least 1 [m]."""
    levels = 0
    while LEAF << levels < len(points):
        levels += 1
    order = _order(points, levels)
    placed = np.ascontiguousarray(points[order], dtype=np.float64)
    return PointTree(placed, order, _boxes(placed, levels), levels)


def _order(points: Floats, levels: int) -> Ints:
    """Return the indices of the points in the order of the tree, shape (n,).

    Each node of the tree halves its points at the median of the axis along which they extend most.
    """
    n = len(points)
    order = np.arange(n, dtype=np.int64)
    for level in range(levels):
        for node in range(1 << level):
            start, stop = (node * n) >> level, ((node + 1) * n) >> level
            middle = ((2 * node + 1) * n) >> (level + 1)
            own = order[start:stop]
            places = points[own]
            axis = int(np.ptp(places, axis=0).argmax())
            own[:] = own[np.argpartition(places[:, axis], middle - start)]
    return order


def _boxes(points: Floats, levels: int) -> Floats:
    """Return the least and greatest coordinates of each tree node, shape (2^(levels + 1), 6) [m].

    The root has index 1; the points are in the order of the tree.
    """
    leaves = 1 << levels
    boxes = np.zeros((2 * leaves, 6))
    starts = (np.arange(leaves) * len(points)) >> levels
    boxes[leaves:, :3] = np.minimum.reduceat(points, starts, axis=0)
    boxes[leaves:, 3:] = np.maximum.reduceat(points, starts, axis=0)
    for node in range(leaves - 1, 0, -1):
        boxes[node, :3] = np.minimum(boxes[2 * node, :3], boxes[2 * node + 1, :3])
        boxes[node, 3:] = np.maximum(boxes[2 * node, 3:], boxes[2 * node + 1, 3:])
    return boxes
