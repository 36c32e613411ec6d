from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic_server.bodies.balloon.balloon import Balloon, BalloonSettings
from cohaptic_server.bodies.balloon.rubber_balloon import RubberBalloon
from cohaptic_server.bodies.body import Load
from cohaptic_server.numeric import Floats
from cohaptic_server.world.contact import Contact
from cohaptic_server.world.equilibrium import (
    StickingEquilibrium,
    StickingHand,
    solve_sticking,
    touch_down,
)
from tests.examples_of_laws import examples

RADIUS = 0.1  # m, of the balloons
HAND = 400.0  # N/m
NOBODY = StickingEquilibrium(np.zeros((0, 3)), np.zeros((0, 3)), None)


def out(angle: float) -> Floats:
    return np.array([math.cos(angle), math.sin(angle), 0.0])


def meet(body: Balloon, angle: float, others: StickingEquilibrium = NOBODY) -> Contact:
    return touch_down(body, (RADIUS + 0.01) * out(angle), -out(angle), others)


def hand(body: Balloon, angle: float, depth: float, aside: float = 0.0) -> StickingHand:
    """One that came straight in and then went `aside` along the equator."""
    at = (RADIUS - depth) * out(angle) + aside * out(angle + 0.5 * math.pi)
    return StickingHand((at[0], at[1], at[2]), HAND, meet(body, angle))


@given(st.lists(st.tuples(st.floats(0.0, 0.02), st.floats(-0.01, 0.01)), min_size=1, max_size=3))
@settings(max_examples=examples(15), deadline=None)
def test_every_tip_is_where_its_material_is(
    small_balloon: Balloon, ways: list[tuple[float, float]]
) -> None:
    hands = [hand(small_balloon, 2.0 * i, *way) for i, way in enumerate(ways)]
    found = solve_sticking(small_balloon, hands)
    assert found.response is not None
    for stuck, force in zip(hands, found.force, strict=True):
        tip = np.array(stuck.intention) + force / HAND
        material = stuck.contact.moved(found.response.displacement)
        # A micrometre: forces are found to 1e-7 N on springs of hundreds of N/m.
        assert tip == pytest.approx(material, abs=1e-6)


@given(st.floats(0.001, 0.02), st.floats(-0.01, 0.01))
@settings(max_examples=examples(10), deadline=None)
def test_a_lone_hand_and_the_body_are_springs_in_a_row_in_every_direction(
    small_balloon: Balloon, depth: float, aside: float
) -> None:
    lone = hand(small_balloon, 0.0, depth, aside)
    found = solve_sticking(small_balloon, [lone])
    where = lone.contact
    units = [Load(where.vertices, where.weights, axis, 0.0) for axis in np.eye(3)]
    C = small_balloon.respond(units).compliance
    way = where.point - np.array(lone.intention)
    assert found.force[0] == pytest.approx(
        np.linalg.solve(C + np.eye(3) / HAND, way), rel=1e-6, abs=1e-9
    )


def test_who_drags_is_felt_beside_and_by_the_law_of_maxwell(balloon: Balloon) -> None:
    """What A feels of a way of B, B feels of the same way of A: the whole is symmetric."""
    angles, way = (0.0, math.radians(30.0)), 0.003
    rest = solve_sticking(balloon, [hand(balloon, a, 0.015) for a in angles])
    changes: list[float] = []
    for who in (0, 1):
        moved = [hand(balloon, a, 0.015, way * (i == who)) for i, a in enumerate(angles)]
        change = solve_sticking(balloon, moved).force - rest.force
        felt = 1 - who
        changes.append(float(change[felt] @ out(angles[felt] + 0.5 * math.pi)))
    assert changes[0] == pytest.approx(changes[1], rel=1e-6)
    # It goes along with the material.
    assert changes[0] > 0.1


def test_rubber_is_solved_on_its_tangent() -> None:
    body = RubberBalloon(BalloonSettings(subdivisions=2, contact_radius=0.03))
    free = touch_down(body, (RADIUS + 0.01) * out(0.0), -out(0.0), NOBODY)
    stuck = StickingHand((0.085, 0.004, 0.0), HAND, free)
    found = solve_sticking(body, [stuck])
    assert found.response is not None
    tip = np.array(stuck.intention) + found.force[0] / HAND
    # A body that is solved to its own tolerance.
    assert tip == pytest.approx(free.moved(found.response.displacement), abs=1e-5)
    assert found.force[0, 0] > 0.5
    assert found.force[0, 1] < -0.1
