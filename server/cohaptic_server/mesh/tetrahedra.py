"""An immutable mesh of tetrahedra that fills a solid, and the boundary surface of the mesh."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
import scipy.sparse.csgraph

from cohaptic.errors import BodyError
from cohaptic.vec import ZERO, Vec3, add
from cohaptic_server.numeric import Floats, Ints, Mask, vec3

EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))  # of a tetrahedron, in CalculiX's order
_FACES = ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2))  # counter-clockwise from outside
_FLAT = 1e-9  # largest volume of a flat tetrahedron over the cube of its longest edge


class SeveralPiecesError(BodyError):
    """A solid consists of several separate pieces.

    Args:
        count: Number of pieces.
    """

    def __init__(self, count: int) -> None:
        super().__init__(
            f"the solid is in {count} pieces, and it must be one: join them, or take one of them"
            " out"
        )
        self.count = count


@dataclass(frozen=True, eq=False)
class TetMesh:
    """Corners and tetrahedra of a solid at rest.

    Args:
        vertices: Positions of the corners, shape (n, 3) [m].
        tets: Indices into `vertices`, of positive volume, shape (m, 4).
        origin: Origin of the mesh's frame, as a point of the scaled file of the body [m].
    """

    vertices: Floats
    tets: Ints
    origin: Vec3 = ZERO

    @classmethod
    def checked(cls, vertices: Floats, tets: Ints) -> TetMesh:
        """Check vertices and tetrahedra, and make a mesh of them.

        Unused vertices are dropped, and inverted tetrahedra are reoriented.

        Raises:
            SeveralPiecesError: The mesh is in several pieces.
            BodyError: The mesh is empty, not finite, or has flat tetrahedra.
        """
        if tets.ndim != 2 or tets.shape[1] != 4 or not len(tets):
            raise BodyError(f"a solid needs tetrahedra of four corners; these are {tets.shape}")
        if tets.min() < 0 or tets.max() >= len(vertices):
            raise BodyError(f"a tetrahedron names vertex {tets.max()} of {len(vertices)}")
        used, renamed = np.unique(tets, return_inverse=True)
        x, t = vertices[used], renamed.reshape(tets.shape).astype(np.int64)
        bad = ~np.isfinite(x).all(axis=1)
        if bad.any():
            raise BodyError(f"{bad.sum()} vertices have a coordinate that is not a number")
        inverted = volumes(x, t) < 0.0
        t[inverted] = t[inverted][:, [0, 2, 1, 3]]
        without = flat(x, t)
        if without.any():
            raise BodyError(
                f"{without.sum()} of {len(t)} tetrahedra are flat (volume below {_FLAT:g} of the"
                " cube of their longest edge): mesh the object anew"
            )
        count = int(pieces(t, len(x)).max()) + 1
        if count > 1:
            raise SeveralPiecesError(count)
        return cls(x, t)

    def centred(self) -> TetMesh:
        """Return the mesh in a frame whose origin is about the middle of the mesh's bounding box.

        The new origin has few digits, so that a person can read it, and a mesh that is centred
        already stays where it is: it is rounded to a power of ten below a tenth of the size.
        """
        x = self.vertices
        low, high = x.min(axis=0), x.max(axis=0)
        digits = math.ceil(-math.log10(0.1 * float((high - low).max())))
        middle = np.asarray(np.round(0.5 * (low + high), digits), dtype=np.float64)
        middle += 0.0  # no negative zero
        return TetMesh(x - middle, self.tets, add(self.origin, vec3(middle)))

    @property
    def volume(self) -> float:
        """Volume of all tetrahedra [m^3]."""
        return float(volumes(self.vertices, self.tets).sum())


def volumes(x: Floats, tets: Ints) -> Floats:
    """Return the signed volume of each tetrahedron, shape (m,) [m^3]."""
    a, b, c = (x[tets[:, k]] - x[tets[:, 0]] for k in (1, 2, 3))
    return np.asarray(np.einsum("mi,mi->m", np.cross(a, b), c) / 6.0)


def flat(x: Floats, tets: Ints) -> Mask:
    """Return whether each tetrahedron, of either orientation, has practically no volume, (m,)."""
    edges = x[tets[:, [a for a, _ in EDGES]]] - x[tets[:, [b for _, b in EDGES]]]
    longest = np.sqrt(np.einsum("mei,mei->me", edges, edges).max(axis=1))
    return np.asarray(np.abs(volumes(x, tets)) <= _FLAT * longest**3, dtype=np.bool_)


def boundary(tets: Ints) -> Ints:
    """Return the outer faces of a mesh, which belong to one tetrahedron only, shape (f, 3).

    The corners of each face are counter-clockwise from outside.
    """
    faces = tets[:, np.array(_FACES)].reshape(-1, 3)
    key = np.sort(faces, axis=1)
    _, first, counts = np.unique(_numbered(key), return_index=True, return_counts=True)
    return np.asarray(faces[np.sort(first[counts == 1])], dtype=np.int64)


def quadratic(mesh: TetMesh) -> tuple[Floats, Ints]:
    """Convert a mesh to ten-node tetrahedra with straight edges.

    Returns:
        Nodes: the corners, then the middle of each edge, shape (n + e, 3) [m]; elements: four
        corners and six middles in the order of `EDGES`, shape (m, 10).
    """
    pairs = np.sort(mesh.tets[:, np.array(EDGES)].reshape(-1, 2), axis=1)
    _, first, index = np.unique(_numbered(pairs), return_index=True, return_inverse=True)
    edges = pairs[first]
    middles = mesh.vertices[edges].mean(axis=1)
    numbers = len(mesh.vertices) + index.reshape(-1, 6)
    return np.concatenate([mesh.vertices, middles]), np.concatenate([mesh.tets, numbers], axis=1)


def quadratic_boundary(elements: Ints) -> Ints:
    """Return the boundary triangles of ten-node tetrahedra, shape (4 f, 3).

    Each of the f outer faces is cut into four triangles at the middles of its edges.

    Args:
        elements: Nodes of each tetrahedron, in the order of `quadratic`, shape (m, 10).
    """
    corner = {frozenset(pair): 4 + k for k, pair in enumerate(EDGES)}
    faces = elements[:, np.array(_FACES)].reshape(-1, 3)
    middles = np.array(
        [[corner[frozenset((f[i], f[(i + 1) % 3]))] for i in range(3)] for f in _FACES]
    )
    between = elements[:, middles].reshape(-1, 3)
    key = np.sort(faces, axis=1)
    _, first, counts = np.unique(_numbered(key), return_index=True, return_counts=True)
    outer = np.sort(first[counts == 1])
    (a, b, c), (ab, bc, ca) = faces[outer].T, between[outer].T
    quarters = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return np.concatenate([np.stack(quarter, axis=1) for quarter in quarters])


def _numbered(rows: Ints) -> Ints:
    """Return one number for each row of vertex indices (m, k), in the order of the rows, (m,).

    Sorting these numbers takes a tenth of the time of sorting the rows. Numbers for rows of three
    vertices fit into 64 bits up to two million vertices; a mesh that is factored has a tenth of
    that number.
    """
    n = int(rows.max(initial=0)) + 1
    if n ** rows.shape[1] > np.iinfo(np.int64).max:
        return np.unique(rows, axis=0, return_inverse=True)[1].reshape(-1)
    numbers = rows[:, 0]
    for k in range(1, rows.shape[1]):
        numbers = numbers * n + rows[:, k]
    return numbers


def pieces(tets: Ints, n: int) -> Ints:
    """Return the index of the connected piece that contains each of `n` vertices, shape (n,).

    Different pieces share no vertex.
    """
    rows, columns = np.repeat(tets[:, 0], 3), tets[:, 1:].ravel()
    graph = sp.coo_array((np.ones(len(rows), dtype=np.int8), (rows, columns)), shape=(n, n))
    _, part = scipy.sparse.csgraph.connected_components(sp.csr_array(graph), directed=False)
    return np.asarray(part, dtype=np.int64)


def face_pieces(tets: Ints) -> Ints:
    """Return the index of the piece that contains each tetrahedron, shape (m,).

    Tetrahedra of one piece are connected by faces. Two pieces may share a corner or an edge, about
    which one of them can turn as about a hinge.
    """
    count = len(tets)
    key = _numbered(np.sort(tets[:, np.array(_FACES)].reshape(-1, 3), axis=1))
    order = np.argsort(key, kind="stable")
    shared = np.flatnonzero(key[order][1:] == key[order][:-1])
    a, b = order[shared] // len(_FACES), order[shared + 1] // len(_FACES)
    graph = sp.coo_array((np.ones(len(a), dtype=np.int8), (a, b)), shape=(count, count))
    _, part = scipy.sparse.csgraph.connected_components(sp.csr_array(graph), directed=False)
    return np.asarray(part, dtype=np.int64)


def gradients(x: Floats, tets: Ints) -> Floats:
    """Return the gradients of each tetrahedron's four barycentric coordinates, (m, 4, 3) [1/m]."""
    edges = x[tets[:, 1:]] - x[tets[:, :1]]
    g = np.empty((len(tets), 4, 3))
    g[:, 1:] = np.swapaxes(np.linalg.inv(edges), 1, 2)
    g[:, 0] = -g[:, 1:].sum(axis=1)
    return g
