"""A hand that slides over the balloon, science 3.7."""

from __future__ import annotations

import pytest

from cohaptic_experiments.sliding.slide import measure
from cohaptic_server.bodies.balloon.balloon import Balloon


@pytest.fixture(scope="module")
def body() -> Balloon:
    return Balloon()


def test_a_mesh_patch_keeps_the_force_of_a_sliding_hand_and_a_plane_does_not(
    body: Balloon,
) -> None:
    """At 0.1 m/s and 80 ms each way the force is always within 5 % of the reference."""
    mesh = measure("mesh", 0.1, 0.08, body=body)
    assert mesh.median <= mesh.p95 <= mesh.worst < 0.05
    assert mesh.step < 0.02
    sphere = measure("sphere", 0.1, 0.08, body=body, angle=0.8)
    plane = measure("plane", 0.1, 0.08, body=body, angle=0.3)
    assert mesh.worst < sphere.worst < 0.05 < plane.median
    assert mesh.force == pytest.approx(plane.force, rel=0.05)
