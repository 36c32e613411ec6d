from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from cohaptic_server.mesh.surface import LEAF, point_tree
from tests.examples_of_laws import examples

COUNTS = st.sampled_from([1, 2, LEAF, LEAF + 1, 3 * LEAF, 200, 642])


@given(st.integers(0, 2**32 - 1), COUNTS, st.floats(0.0, 4.0))
@settings(max_examples=examples(60), deadline=None)
def test_it_finds_what_scipy_finds(seed: int, count: int, distance: float) -> None:
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(count, 3))
    tree, reference = point_tree(points), cKDTree(points)
    place = distance * rng.normal(size=3)
    x, y, z = place.tolist()
    nearest = tree.nearest(x, y, z)
    assert np.linalg.norm(points[nearest] - place) == pytest.approx(reference.query(place)[0])
    radius = float(rng.uniform(0.0, 2.0 + distance))
    found = np.zeros(count, dtype=np.int64)
    within = found[: tree.within(x, y, z, radius, found)]
    assert sorted(within.tolist()) == sorted(reference.query_ball_point(place, radius))
