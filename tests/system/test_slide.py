"""A hand that slides over the balloon, science 3.7."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cohaptic.vec import norm, sub
from cohaptic_experiments.sliding.slide import CLEARANCE, GuidedHand, Way, measure, true_forces
from cohaptic_server.bodies.balloon.balloon import Balloon


@pytest.fixture(scope="module")
def body() -> Balloon:
    return Balloon()


@pytest.mark.slow
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


def test_the_reference_of_a_hand_at_rest_is_its_depth_over_the_compliance(body: Balloon) -> None:
    shallow, deep = true_forces(body, [(0.095, 0.0, 0.0), (0.09, 0.0, 0.0)])
    assert deep == pytest.approx(2.0 * shallow, rel=0.05)
    assert true_forces(body, [(0.12, 0.0, 0.0)]) == 0.0


def test_the_hand_dips_slides_at_full_depth_and_comes_out_without_a_jerk() -> None:
    way = Way((0.0, 0.0, 0.0), 0.1, 0.01, 0.2, math.pi / 2.0, 0.08)
    times = np.arange(0.0, way.end + 0.1, 0.001)
    path = [way.at(t) for t in times]
    height = np.array([norm(p) for p in path]) - 0.1
    begins, ends = way.steady
    sliding = (times >= way.start) & (times <= ends)
    assert height[sliding] == pytest.approx(-0.01)
    assert (height[0], height[-1]) == pytest.approx((CLEARANCE, CLEARANCE))
    turned = np.unwrap([math.atan2(p[1], p[0]) for p in path])
    steady = (times >= begins) & (times <= ends)
    assert np.ptp(turned[steady]) == pytest.approx(math.pi / 2.0, abs=0.01)
    assert np.diff(turned[steady]) * 0.1 == pytest.approx(0.2 * 0.001)
    velocity = np.diff(path, axis=0) / 0.001
    assert np.abs(np.diff(velocity, axis=0)).max() < 0.002  # m/s in a millisecond: 2 m/s^2


def test_the_guided_hand_feels_nothing_and_knows_its_speed() -> None:
    way = Way((0.0, 0.0, 0.0), 0.1, 0.01, 0.2, math.pi / 2.0, 0.0)
    hand = GuidedHand(way)
    first = hand.read(50.0)
    hand.write((100.0, 0.0, 0.0))
    assert hand.read(50.0) == first
    sample = hand.read(50.0 + way.steady[0])
    assert norm(sub(sample.position, way.at(way.steady[0]))) < 1e-9
    assert norm(sample.velocity) == pytest.approx(0.2 * 0.09 / 0.1, rel=1e-3)
