from __future__ import annotations

import numpy as np
import pytest

from cohaptic.errors import BodyError
from cohaptic_server.mesh.icosphere import icosphere
from cohaptic_server.mesh.surface import SurfaceMesh, face_area_vectors

X, FACES = icosphere(2, 0.1)
MESH = SurfaceMesh(X, FACES)


def test_rings_hold_exactly_the_faces_of_each_vertex() -> None:
    for vertex in range(len(MESH.vertices)):
        expected = set(np.flatnonzero((MESH.faces == vertex).any(axis=1)).tolist())
        assert set(MESH.rings[vertex].tolist()) == expected


def test_quadrature_points_lie_in_their_faces_and_cover_the_surface() -> None:
    q = MESH.quadrature
    corners = MESH.vertices[q.vertices]
    assert q.points == pytest.approx(np.einsum("qk,qki->qi", q.shares, corners))
    assert q.shares.min() > 0.0
    assert q.shares.sum(axis=1) == pytest.approx(1.0)
    areas = np.linalg.norm(face_area_vectors(MESH.vertices, MESH.faces), axis=1)
    assert q.areas.sum() == pytest.approx(areas.sum())


def test_quadrature_is_exact_for_linear_functions() -> None:
    q = MESH.quadrature
    areas = np.linalg.norm(face_area_vectors(MESH.vertices, MESH.faces), axis=1)
    centroids = MESH.vertices[MESH.faces].mean(axis=1)
    assert q.areas @ q.points == pytest.approx(areas @ centroids, abs=1e-15)


def test_the_size_of_a_sphere_is_its_radius() -> None:
    # Facets have a little less area than the sphere: 2 % at this resolution.
    assert MESH.size == pytest.approx(0.1, rel=0.02)


def test_a_vertex_without_faces_is_named() -> None:
    x = np.vstack([X, [[9.0, 9.0, 9.0]]])
    with pytest.raises(BodyError, match=f"vertex {len(x) - 1} "):
        SurfaceMesh(x, FACES)


def test_a_wrong_shape_is_named() -> None:
    with pytest.raises(BodyError, match=r"\(2, 2\)"):
        SurfaceMesh(np.zeros((2, 2)), np.zeros((1, 3), dtype=np.int64))
