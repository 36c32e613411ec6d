from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from cohaptic_server.bodies.solid.places import PLACE, Places

clouds = st.tuples(st.integers(1, 300), st.integers(0, 2**32 - 1), st.floats(0.0, 1.0))


@given(clouds)
def test_every_vertex_has_one_rank(cloud: tuple[int, int, float]) -> None:
    n, seed, flatness = cloud
    x = np.random.default_rng(seed).uniform(-1, 1, (n, 3)) * [1.0, 1.0, flatness]
    places = Places(x)
    assert places.count == -(-n // PLACE)
    assert sorted(places.rank.tolist()) == list(range(n))
    assert (places.order[places.rank] == np.arange(n)).all()
    assert set(places.vertices(np.arange(places.count)).tolist()) == set(range(n))


@given(clouds, st.floats(0.0, 2.0))
def test_no_place_within_reach_is_left_out(cloud: tuple[int, int, float], reach: float) -> None:
    n, seed, flatness = cloud
    x = np.random.default_rng(seed).uniform(-1, 1, (n, 3)) * [1.0, 1.0, flatness]
    places = Places(x)
    apart = np.linalg.norm(x[:, None] - x[None], axis=2)
    kept = np.zeros((places.count, places.count), dtype=np.bool_)
    for k, found in enumerate(places.within(reach)):
        kept[k, found] = True
        assert (np.diff(found) > 0).all()
    place = places.rank // PLACE
    # Single distances are rounded one way or the other.
    assert kept[place[:, None], place[None]][apart < reach * (1.0 - 1e-9)].all()


def test_what_lies_together_is_read_together() -> None:
    """A disc of vertices on a grid has few runs, whatever the order of the vertices."""
    side = 64
    grid = np.stack(np.meshgrid(*[np.arange(side)] * 2), axis=-1).reshape(-1, 2)
    x = np.column_stack([grid, np.zeros(len(grid))]).astype(float)
    x = np.random.default_rng(1).permutation(x)
    places = Places(x)
    runs = list[int]()
    for centre in np.random.default_rng(2).uniform(10, side - 10, (50, 2)):
        inside = np.linalg.norm(x[:, :2] - centre, axis=1) < 4.5
        ranks = np.sort(places.rank[inside])
        runs.append(1 + int((np.diff(ranks) > 1).sum()))
    assert np.mean(runs) < 20  # of 64 vertices; in the order of the mesh there are 60
