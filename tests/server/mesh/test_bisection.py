from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic_server.mesh.tetrahedra import EDGES, TetMesh, volumes
from cohaptic_server.mesh.thin_parts import longest_over_wanted, with_shorter_edges
from cohaptic_server.numeric import Floats
from cohaptic_server.testing.blocks import block
from tests.examples_of_laws import examples

seeds = st.integers(0, 2**32 - 1)
NO_LIMIT = 10**6


def shaken(seed: int) -> TetMesh:
    mesh = block((0.1, 0.08, 0.01), (3, 3, 1))
    x = mesh.vertices + np.random.default_rng(seed).uniform(-1e-3, 1e-3, mesh.vertices.shape)
    return TetMesh.checked(x, mesh.tets)


def longest_edges(mesh: TetMesh) -> np.ndarray:
    pairs = mesh.vertices[mesh.tets[:, np.array(EDGES)]]
    return np.asarray(np.linalg.norm(pairs[:, :, 0] - pairs[:, :, 1], axis=2).max(axis=1))


def even(mesh: TetMesh, length: float) -> Floats:
    return np.full(len(mesh.vertices), length)


@given(seeds, st.floats(0.008, 0.05), st.floats(1.0, 3.0))
@settings(max_examples=examples(15), deadline=None)
def test_no_edge_is_longer_than_wanted_and_the_object_is_the_same(
    seed: int, length: float, wider: float
) -> None:
    """Lengths that grow to one side, and are any beyond a plane."""
    mesh = shaken(seed)
    x = mesh.vertices[:, 0]
    wanted = length * np.interp(x, [-0.05, 0.05], [1.0, wider])
    wanted[x > np.random.default_rng(seed).uniform(-0.05, 0.06)] = np.inf
    found = with_shorter_edges(mesh, wanted, NO_LIMIT)
    assert np.array_equal(found.wanted[: len(x)], wanted)
    assert longest_over_wanted(found.tets, found.wanted) <= found.excess
    assert found.excess == min(1.0, longest_over_wanted(mesh, wanted))
    volume = volumes(found.tets.vertices, found.tets.tets)
    assert volume.min() > 0.0
    each = np.bincount(found.parent, volume, len(mesh.tets))
    assert each == pytest.approx(volumes(mesh.vertices, mesh.tets), rel=1e-9)
    faces = np.sort(found.tets.tets, axis=1)[:, [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]]]
    counts = Counter(map(tuple, faces.reshape(-1, 3).tolist()))
    assert set(counts.values()) <= {1, 2}
    # An edge of one side with a vertex in its middle on the other one would be a face too many.
    outside = sum(count == 1 for count in counts.values())
    edges = {pair for face, count in counts.items() if count == 1 for pair in _sides(face)}
    used = {vertex for pair in edges for vertex in pair}
    assert len(used) - len(edges) + outside == 2  # Euler's formula of a ball's surface
    assert np.array_equal(found.tets.vertices[: len(mesh.vertices)], mesh.vertices)


def _sides(face: tuple[int, ...]) -> list[tuple[int, int]]:
    a, b, c = face
    return [(a, b), (b, c), (a, c)]


@given(seeds, st.integers(60, 3000))
@settings(max_examples=examples(20), deadline=None)
def test_there_are_never_more_than_there_may_be(seed: int, limit: int) -> None:
    mesh = shaken(seed)
    found = with_shorter_edges(mesh, even(mesh, 0.009), limit)
    assert len(found.tets.tets) <= max(limit, len(mesh.tets))
    # What was reached is reached everywhere.
    assert longest_edges(found.tets).max() <= 0.009 * found.excess * (1.0 + 1e-12)
