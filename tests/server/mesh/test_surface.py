from __future__ import annotations

import numpy as np
import pytest

from cohaptic_server.mesh.icosphere import icosphere
from cohaptic_server.mesh.surface import SurfaceMesh, face_area_vectors

X, FACES = icosphere(2, 0.1)
MESH = SurfaceMesh(X, FACES)


def test_quadrature_points_lie_in_their_faces_and_cover_the_surface() -> None:
    q = MESH.quadrature
    corners = MESH.vertices[q.vertices]
    assert q.points == pytest.approx(np.einsum("qk,qki->qi", q.fractions, corners))
    assert q.fractions.min() > 0.0
    assert q.fractions.sum(axis=1) == pytest.approx(1.0)
    areas = np.linalg.norm(face_area_vectors(MESH.vertices, MESH.faces), axis=1)
    assert q.areas.sum() == pytest.approx(areas.sum())


def test_quadrature_is_exact_for_linear_functions() -> None:
    q = MESH.quadrature
    areas = np.linalg.norm(face_area_vectors(MESH.vertices, MESH.faces), axis=1)
    centroids = MESH.vertices[MESH.faces].mean(axis=1)
    assert q.areas @ q.points == pytest.approx(areas @ centroids, abs=1e-15)
