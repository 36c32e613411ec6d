"""How good tetrahedra are, and how thick the object is under its surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cohaptic_server.bodies.elements import gradients
from cohaptic_server.bodies.mesh import Floats, Ints, SurfaceMesh, face_area_vectors
from cohaptic_server.bodies.tetrahedra import EDGES, TetMesh, volumes

_SMOOTH = 0.82  # cosine of 35 degrees


@dataclass(frozen=True, slots=True)
class Quality:
    """Of a mesh of tetrahedra.

    Args:
        sharpest: Smallest angle between two faces of one [degrees]; 70.5 in a regular one.
        bluntest: Largest such angle [degrees].
        fullest: Median of the volume over that of the regular one with the same longest edge.
        flattest: Least of that ratio.
        poor: Tetrahedra whose ratio is below a hundredth.
    """

    sharpest: float
    bluntest: float
    fullest: float
    flattest: float
    poor: int


def quality(tets: TetMesh) -> Quality:
    """Angles and ratios of all tetrahedra."""
    g = gradients(tets.vertices, tets.tets)
    n = g / np.linalg.norm(g, axis=2, keepdims=True)
    # Gradients point into the element, away from the face that lies opposite to their corner.
    cosines = [-np.einsum("mi,mi->m", n[:, a], n[:, b]) for a, b in EDGES]
    angles = np.degrees(np.arccos(np.clip(cosines, -1.0, 1.0)))
    x = tets.vertices
    edges = np.stack([x[tets.tets[:, a]] - x[tets.tets[:, b]] for a, b in EDGES], axis=1)
    longest = np.sqrt(np.einsum("mei,mei->me", edges, edges).max(axis=1))
    ratio = volumes(x, tets.tets) * 6.0 * 2.0**0.5 / longest**3
    return Quality(
        float(angles.min()),
        float(angles.max()),
        float(np.median(ratio)),
        float(ratio.min()),
        int((ratio < 0.01).sum()),
    )


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
