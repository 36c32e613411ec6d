from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from cohaptic_server.bodies.solid.places import PLACE, Places

clouds = st.tuples(st.integers(1, 300), st.integers(0, 2**32 - 1), st.floats(0.0, 1.0))


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
