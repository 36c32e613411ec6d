"""The thickness of a body under its surface, and the smoothness of the surface."""

from __future__ import annotations

import numpy as np

from cohaptic_server.mesh.surface import SurfaceMesh, face_area_vectors
from cohaptic_server.numeric import Floats, Ints, Mask

_ROUND = 1e-9  # rounding of barycentric coordinates, and of distances over the body's size
_SMOOTH = 0.82  # cosine of 35 degrees, between the normals of a vertex and of a face


def depth_under(mesh: SurfaceMesh, vertices: Ints) -> Floats:
    """Depth under each vertex down to which its side of the body is the nearest, (k,) [m].

    The depth is half of the thickness of a plate, and the radius of a tube or a ball. Where the
    other side is nearer already at a fiftieth of the body's size, the depth is half of the
    thickness straight below, at most that fiftieth.
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
    """Distance from each vertex straight through the body to the other side, shape (k,) [m].

    A ray enters against the vertex's normal, and leaves through the nearest triangle that it meets
    from inside (Moeller, Trumbore 1997); the thickness is infinite where it meets none.
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
    """Whether each vertex lies away from sharp edges and tips, shape (n,).

    The normals of all faces round such a vertex are within 35 degrees of the vertex's normal.
    """
    areas = face_area_vectors(mesh.vertices, mesh.faces)
    normals = areas / np.maximum(np.linalg.norm(areas, axis=1, keepdims=True), 1e-300)
    along = np.einsum("fci,fi->fc", mesh.normals[mesh.faces], normals)
    least = np.ones(len(mesh.vertices))
    np.minimum.at(least, mesh.faces.ravel(), along.ravel())
    return np.asarray(least > _SMOOTH)
