from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.objects.surface.accept import nearest_point
from tests.examples_of_laws import examples

TETRAHEDRON = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=examples(50), deadline=None)
def test_the_nearest_point_of_a_tetrahedron_beats_every_other_one(seed: int) -> None:
    rng = np.random.default_rng(seed)
    mesh = SurfaceMesh(rng.normal(size=(4, 3)), TETRAHEDRON)
    p = rng.normal(size=3) * 2
    best = np.linalg.norm(nearest_point(mesh, p) - p)
    fractions = rng.dirichlet([1, 1, 1], size=300)
    others = np.einsum("sk,fki->fsi", fractions, mesh.vertices[mesh.faces]) - p
    assert best <= np.linalg.norm(others, axis=2).min() + 1e-9
