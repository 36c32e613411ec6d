"""How thick a body is under its surface."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from cohaptic_server.mesh.surface import SurfaceMesh, face_area_vectors
from cohaptic_server.numeric import Floats, Ints

_SMOOTH = 0.82  # cosine of 35 degrees


def depth_under(mesh: SurfaceMesh, vertices: Ints) -> Floats:
    """How far under each vertex its own side is still the nearest, shape (k,) [m].

    Half of the thickness of a plate, the radius of a tube or a ball.
    """
    steps = mesh.size * np.linspace(0.02, 1.0, 50)
    into = mesh.vertices[vertices][:, None] - steps[:, None] * mesh.normals[vertices][:, None]
    nearest = np.asarray(mesh.quadrature.tree.query(into)[0])
    # A sample of the surface lies beside the vertex, not under it: allow for that.
    own = nearest >= 0.9 * steps - 0.1 * mesh.size / len(mesh.vertices) ** 0.5
    return np.asarray(np.where(np.logical_and.accumulate(own, axis=1), steps, 0.0).max(axis=1))


def thickness(mesh: SurfaceMesh, vertices: Ints) -> Floats:
    """How far it is straight in from each vertex to the other side, shape (k,) [m]."""
    steps = mesh.size * np.linspace(0.02, 2.0, 100)
    into = mesh.vertices[vertices][:, None] - steps[:, None] * mesh.normals[vertices][:, None]
    nearest = np.asarray(mesh.quadrature.tree.query(into)[1])
    normals = face_area_vectors(mesh.vertices, mesh.faces)[nearest // mesh.split**2]
    inside = np.einsum("ksi,ksi->ks", into - mesh.quadrature.points[nearest], normals) < 0.0
    return np.asarray(np.where(np.logical_and.accumulate(inside, axis=1), steps, 0.0).max(axis=1))


def is_smooth(mesh: SurfaceMesh) -> npt.NDArray[np.bool_]:
    """Which vertices lie on no edge or tip: all faces round them look their way, shape (n,)."""
    areas = face_area_vectors(mesh.vertices, mesh.faces)
    normals = areas / np.maximum(np.linalg.norm(areas, axis=1, keepdims=True), 1e-300)
    along = np.einsum("fci,fi->fc", mesh.normals[mesh.faces], normals)
    least = np.ones(len(mesh.vertices))
    np.minimum.at(least, mesh.faces.ravel(), along.ravel())
    return np.asarray(least > _SMOOTH)
