"""What the measurement of default objects says of the balloon, where it is known otherwise."""

from __future__ import annotations

import numpy as np
import pytest

from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.bodies.touched_body import vertex_compliance
from default_object import FIRST, FORCE, moved, pairs, seen_from


@pytest.fixture(scope="module")
def balloon() -> Balloon:
    return Balloon()


def test_a_ray_meets_the_side_that_it_comes_from(balloon: Balloon) -> None:
    for azimuth in (0.0, 90.0, 200.0):
        out = np.array([np.cos(np.radians(azimuth)), np.sin(np.radians(azimuth)), 0.0])
        met = balloon.mesh.vertices[seen_from(balloon, azimuth)]
        assert met @ out > 0.95 * np.linalg.norm(met)


def test_dents_are_those_of_the_compliance_and_answer_alike(balloon: Balloon) -> None:
    first, second = seen_from(balloon, 0.0), seen_from(balloon, 120.0)
    soft = vertex_compliance(balloon)
    field, here, there = moved(balloon, first, second)
    assert here == pytest.approx(FORCE * soft[first], rel=0.05)
    # Maxwell and Betti: what one does to the other is what the other does to it.
    assert there == pytest.approx(moved(balloon, second, first)[2], rel=1e-6)
    assert np.linalg.norm(field, axis=1).max() >= here


def test_every_azimuth_of_a_balloon_has_room_for_two(balloon: Balloon) -> None:
    assert len(pairs(balloon, 90.0)) == FIRST
    assert not pairs(balloon, 0.0)  # one place has none
