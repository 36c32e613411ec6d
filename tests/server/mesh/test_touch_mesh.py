"""What is left of a fine mesh for touching."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from cohaptic.control.geometry import LocalSurface
from cohaptic.control.mesh_fit import RestSurface
from cohaptic.control.mesh_surface import MeshSurface
from cohaptic.protocol.neighbourhood import MAX_VERTICES
from cohaptic.vec import ZERO, Vec3, dot, scale, unit
from cohaptic_server.mesh.icosphere import icosphere
from cohaptic_server.mesh.surface import SurfaceMesh, face_area_vectors
from cohaptic_server.mesh.touch_mesh import TouchMesh, thinned
from cohaptic_server.numeric import Floats, Ints
from tests.neighbourhoods import facts

RADIUS = 0.1  # m
BALL = SurfaceMesh(*icosphere(4, RADIUS))  # vertices 7 mm apart
distances = st.floats(0.01, 0.025)


def holes(faces: Ints) -> int:
    """Edges that have not one face on each side."""
    edges = [
        tuple(e) for face in faces.tolist() for e in zip(face, face[1:] + face[:1], strict=True)
    ]
    assert len(set(edges)) == len(edges)
    return len(set(edges) - {(b, a) for a, b in edges})


def handles(mesh: TouchMesh) -> float:
    """Of a closed surface: 0 of a ball, 1 of a ring."""
    return 1.0 - 0.5 * (len(mesh.vertices) - 0.5 * len(mesh.faces))


@given(distances)
def test_what_is_left_lies_evenly_and_is_closed(apart: float) -> None:
    mesh = thinned(BALL, apart)
    assert (np.diff(mesh.vertices) > 0).all()
    nearest = np.asarray(cKDTree(mesh.points).query(mesh.points, k=[2])[0])
    assert nearest.min() > apart
    assert np.max(cKDTree(mesh.points).query(BALL.vertices)[0]) <= apart
    assert 0.9 * apart < mesh.spacing < 1.6 * apart
    assert holes(mesh.faces) == 0
    assert handles(mesh) == 0.0


@given(distances.map(lambda apart: min(apart, 0.015)), st.integers(0, 2**32 - 1))
def test_a_finger_finds_the_same_ball(apart: float, seed: int) -> None:
    """The client's surface over the fewer vertices, away from where its patch was made."""
    mesh = thinned(BALL, apart)
    rng = np.random.default_rng(seed)
    out = rng.normal(size=3)
    out /= np.linalg.norm(out)
    near = np.flatnonzero(mesh.points @ out > 0.06)
    rest = RestSurface(
        [(x, y, z) for x, y, z in mesh.points.tolist()],
        [(a, b, c) for a, b, c in mesh.faces.tolist()],
    )
    normal: Vec3 = (float(out[0]), float(out[1]), float(out[2]))
    base = LocalSurface(scale(normal, RADIUS), normal, 0.0, 0.004, ZERO, ZERO)
    surface = MeshSurface(rest, base, facts((k, *ZERO, 0.004) for k in near.tolist()))
    x, y, z = (out + 0.3 * rng.uniform(-1.0, 1.0, 3)).tolist()
    there = unit((x, y, z))
    sight = surface.look(scale(there, RADIUS - 0.005))
    assert sight.depth == pytest.approx(0.005, abs=1e-4)
    assert dot(sight.normal, there) > 0.9999


def plate(side: float, thick: float, count: int) -> SurfaceMesh:
    """A square plate, its edge a ring of triangles between two grids."""
    grid = np.linspace(-0.5 * side, 0.5 * side, count)
    x, y = np.meshgrid(grid, grid, indexing="ij")
    flat = np.stack([x.ravel(), y.ravel(), np.full(count * count, 0.5 * thick)], axis=1)
    points: Floats = np.concatenate([flat, flat * [1.0, 1.0, -1.0]])
    k = np.arange(count * count).reshape(count, count)
    a, b, c, d = (q.ravel() for q in (k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]))
    top = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    rim = np.concatenate([k[0, :-1], k[:-1, -1], k[-1, :0:-1], k[:0:-1, 0]])
    after, n = np.roll(rim, -1), count * count
    sides = np.concatenate(
        [np.stack([rim, after, after + n], axis=1), np.stack([rim, after + n, rim + n], axis=1)]
    )
    return SurfaceMesh(points, np.concatenate([top, top[:, ::-1] + n, sides]))


def test_the_two_sides_of_a_thin_part_are_kept_apart() -> None:
    sheet = plate(0.1, 0.002, 41)
    vectors = face_area_vectors(sheet.vertices, sheet.faces)
    middle = sheet.vertices[sheet.faces].mean(axis=1)
    assert (np.einsum("fi,fi->f", vectors, middle) > 0.0).all()  # of the test's own plate
    mesh = thinned(sheet, 0.01)
    inside = np.abs(mesh.points[:, :2]).max(axis=1) < 0.03
    for side in (1.0, -1.0):
        here = mesh.points[inside & (side * mesh.points[:, 2] > 0.0)]
        # Each side is covered by itself: discs of 10 mm over 60 mm square.
        assert len(here) > 0.06**2 / (math.pi * 0.01**2)
    flat = np.abs(mesh.points[mesh.faces][:, :, :2]).max(axis=(1, 2)) < 0.03
    corners = mesh.points[mesh.faces[flat]]
    assert (np.ptp(corners[:, :, 2], axis=1) == 0.0).all()


@pytest.mark.parametrize(("subdivisions", "least"), [(1, 42), (4, MAX_VERTICES)])
def test_a_body_hardly_larger_than_its_contacts_keeps_a_shape(
    subdivisions: int, least: int
) -> None:
    small = SurfaceMesh(*icosphere(subdivisions, 0.01))
    assert least <= len(thinned(small, 0.5).vertices) < 1000
