from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.mesh.surface import face_area_vectors
from cohaptic_server.mesh.tetrahedra import TetMesh, boundary, volumes
from cohaptic_server.numeric import Floats, Mask
from cohaptic_server.objects.fix_rule import NEAR, Cut, Region, cut_at
from cohaptic_server.testing.blocks import block
from cohaptic_server.world.contact import locate
from tests.examples_of_laws import examples

seeds = st.integers(0, 2**32 - 1)


def shaken(seed: int) -> TetMesh:
    mesh = block((0.1, 0.08, 0.06), (5, 4, 4))
    x = mesh.vertices + np.random.default_rng(seed).uniform(-0.002, 0.002, mesh.vertices.shape)
    return TetMesh.checked(x, mesh.tets)


def cut(mesh: TetMesh, region: Region) -> Cut:
    return cut_at(mesh, region(mesh.vertices), region)


def area(mesh: TetMesh) -> float:
    faces = boundary(mesh.tets)
    return float(np.linalg.norm(face_area_vectors(mesh.vertices, faces), axis=1).sum())


@given(seeds)
@settings(max_examples=examples(30), deadline=None)
def test_a_cut_keeps_the_object_and_its_neighbours(seed: int) -> None:
    """The same body: volume, surface, no face with three tetrahedra, none inside out."""
    mesh, rng = shaken(seed), np.random.default_rng(seed)
    normal, centre = rng.normal(size=3), rng.uniform(-0.02, 0.02, 3)

    def region(x: Floats) -> Mask:
        return np.asarray(
            ((x - centre - np.array([0.0, 0.0, 0.03])) @ normal < 0.0) | (np.abs(x[:, 0]) > 0.04)
        )

    found = cut(mesh, region)
    volume = volumes(found.tets.vertices, found.tets.tets)
    assert volume.min() > 0.0
    assert volume.sum() == pytest.approx(mesh.volume, rel=1e-12)
    assert area(found.tets) == pytest.approx(area(mesh), rel=1e-12)
    faces = np.sort(found.tets.tets, axis=1)[:, [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]]]
    assert set(Counter(map(tuple, faces.reshape(-1, 3).tolist())).values()) <= {1, 2}
    parts = np.bincount(found.parent, volume, len(mesh.tets))
    assert parts == pytest.approx(volumes(mesh.vertices, mesh.tets), rel=1e-9)
    assert np.array_equal(found.tets.vertices[: len(mesh.vertices)], mesh.vertices)


@given(seeds)
@settings(max_examples=examples(30), deadline=None)
def test_no_tetrahedron_is_on_both_sides_by_more_than_what_counts_as_near(seed: int) -> None:
    mesh, rng = shaken(seed), np.random.default_rng(seed)
    normal = rng.normal(size=3)
    normal /= np.linalg.norm(normal)

    def depth(x: Floats) -> Floats:
        return np.asarray((x - [0.0, 0.0, 0.03]) @ normal)

    found = cut(mesh, lambda x: depth(x) < 0.0)
    x, t = found.tets.vertices, found.tets.tets
    near = 1.01 * NEAR * 0.06  # of the longest edge
    low, high = depth(x)[t].min(axis=1), depth(x)[t].max(axis=1)
    assert np.minimum(-low, high).max() < near
    held = found.fixed[t].all(axis=1)
    assert high[held].max() < near or depth(x)[~found.fixed].min() > 0.0
    assert depth(x)[found.fixed].max() < near
    assert depth(x)[~found.fixed].min() > -1e-4


def test_what_ends_at_vertices_is_not_cut() -> None:
    mesh = block((0.1, 0.08, 0.06), (5, 4, 4))
    for limit in (0.015, 0.0, 0.0151, 0.0149):

        def region(x: Floats, limit: float = limit) -> Mask:
            return np.asarray(x[:, 2] <= limit)

        found = cut(mesh, region)
        assert np.array_equal(np.sort(found.tets.tets, axis=0), np.sort(mesh.tets, axis=0))
        assert np.array_equal(found.fixed, mesh.vertices[:, 2] <= limit + 2e-4)


def test_the_stiffness_does_not_depend_on_where_the_nodes_are() -> None:
    """Held up to a height that lies between nodes, and on a mesh with nodes just there."""

    def compliance(mesh: TetMesh, fixed: Mask) -> float:
        body = Solid(mesh, fixed, SolidSettings(1e5, 0.3, contact_radius=0.02))
        free = np.zeros_like(body.mesh.vertices)
        contact = locate(body.mesh, np.array([0.0, 0.0, 0.06]), free, radius=0.02)
        return float(body.respond([contact.load(1.0)]).compliance[0, 0])

    conforming = block((0.04, 0.04, 0.06), (4, 4, 6))
    exact = compliance(conforming, conforming.vertices[:, 2] < 0.0201)
    between = block((0.04, 0.04, 0.06), (4, 4, 5))
    found = cut(between, lambda x: x[:, 2] < 0.02)
    by_nodes = compliance(between, between.vertices[:, 2] < 0.02)
    assert compliance(found.tets, found.fixed) == pytest.approx(exact, rel=0.02)
    assert abs(by_nodes / exact - 1.0) > 0.05
