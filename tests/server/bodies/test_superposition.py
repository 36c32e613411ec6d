from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic_server.bodies.body import Load, LoadArrays
from cohaptic_server.bodies.superposition import seen_by, superpose
from cohaptic_server.numeric import Floats, Narrow

N = 9  # vertices


def compliance() -> Narrow:
    A = np.random.default_rng(0).standard_normal((3 * N, 3 * N))
    return np.asarray(A @ A.T).astype(np.float32)


def loads(sizes: list[int]) -> list[Load]:
    """Loads on as many vertices each."""
    rng = np.random.default_rng(1)
    made: list[Load] = []
    for size in sizes:
        vertices = np.sort(rng.choice(N, size, replace=False)).astype(np.int64)
        weights, direction = rng.random(size), rng.standard_normal(3)
        made.append(Load(vertices, weights / weights.sum(), direction, float(rng.random())))
    return made


def nodal(load: Load) -> Floats:
    """The load's force of one newton on every vertex, shape (3 n,)."""
    force = np.zeros((N, 3))
    force[load.vertices] = load.weights[:, None] * load.direction
    return force.ravel()


@given(sizes=st.lists(st.integers(1, N), max_size=4))
def test_a_field_is_c_times_the_load_and_a_contact_sees_its_mean(sizes: list[int]) -> None:
    C, on = compliance(), loads(sizes)
    starts, ends, vertices, weights, directions, _ = LoadArrays.of(on)
    fields, seen = np.full((len(on), 3 * N), np.nan), np.full((len(on), len(on)), np.nan)
    superpose(C, starts, ends, vertices, weights, directions, fields)
    seen_by(fields, starts, ends, vertices, weights, directions, seen)
    F = np.array([nodal(load) for load in on]).reshape(len(on), 3 * N)
    assert fields == pytest.approx(F @ C.astype(np.float64), rel=1e-12, abs=1e-12)
    assert seen == pytest.approx(F @ C.astype(np.float64) @ F.T, rel=1e-12, abs=1e-12)
