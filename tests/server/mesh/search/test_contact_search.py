"""Inner loops of the search for contacts, beside the same sums in numpy."""

from __future__ import annotations

import numpy as np
import pytest

from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.mesh.surface import SurfaceMesh, pressure
from cohaptic_server.world.contact import locate


@pytest.mark.parametrize("vertex", [0, 5, 100, 300])
def test_the_normal_is_the_sum_over_the_faces_round_each_vertex_under_the_pressure(
    balloon: Balloon, vertex: int
) -> None:
    """Vertices 0 to 11 have five faces, whose row of six is filled up with the first."""
    mesh = balloon.mesh
    free = np.random.default_rng(vertex).uniform(-0.004, 0.004, mesh.vertices.shape)
    at = mesh.vertices[vertex] + free[vertex]
    contact = locate(mesh, at, free, radius=balloon.contact_radius)
    x = mesh.vertices + free
    total = np.zeros(3)
    for v, weight in zip(contact.vertices.tolist(), contact.weights.tolist(), strict=True):
        for face in sorted(set(mesh.rings[v].tolist())):
            a, b, c = x[mesh.faces[face]]
            total += weight * np.cross(b - a, c - a)
    assert contact.normal == pytest.approx(total / np.linalg.norm(total), abs=1e-12)


def test_a_face_without_area_carries_nothing() -> None:
    """A tetrahedron with a vertex in the middle of an edge, and the sliver that closes it."""
    x = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0.5, 0, 0]], dtype=np.float64)
    faces = [[0, 2, 4], [4, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2], [0, 4, 1]]
    mesh = SurfaceMesh(0.1 * x, np.array(faces))
    for radius in (1e-6, 0.01, 0.5):
        vertices, weights = pressure(mesh, 0.1 * x[4], radius)
        assert len(set(vertices.tolist())) == len(vertices) <= 5
        assert weights.sum() == pytest.approx(1.0)
        assert np.isfinite(weights).all()
        assert (weights > 0.0).all()


def test_the_far_side_of_a_thin_part_is_not_pressed() -> None:
    """Two squares face to face, closed by a rim: a leaf of 2 mm."""
    x = [[i, j, k] for k in (0.0, 0.002) for j in (0.0, 0.02) for i in (0.0, 0.02)]
    top, bottom = [[4, 5, 7], [4, 7, 6]], [[0, 3, 1], [0, 2, 3]]
    rim = [[0, 1, 5], [0, 5, 4], [1, 3, 7], [1, 7, 5], [3, 2, 6], [3, 6, 7], [2, 0, 4], [2, 4, 6]]
    mesh = SurfaceMesh(np.array(x), np.array(top + bottom + rim))
    at = np.array([0.01, 0.01, 0.002])
    one_side, _ = pressure(mesh, at, 0.006, np.array([0.0, 0.0, 1.0]))
    both, _ = pressure(mesh, at, 0.006)
    assert set(one_side.tolist()) == {4, 5, 6, 7}
    assert set(both.tolist()) == set(range(8))
