from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic.errors import BodyError
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


def test_a_hand_meets_the_surface_where_the_others_have_left_it(balloon: Balloon) -> None:
    angle = math.radians(30.0)
    alone = meet(balloon, angle)
    start, inward = (RADIUS + 0.01) * out(angle), -out(angle)
    assert np.linalg.norm(np.cross(alone.point - start, inward)) < 1e-3
    beside = solve_sticking(balloon, [hand(balloon, 0.0, 0.02)])
    assert beside.response is not None
    pushed = meet(balloon, angle, beside)
    tip = pushed.moved(beside.response.displacement)
    # On its way; only it is another material that lies there now.
    assert np.linalg.norm(np.cross(tip - start, inward)) < 1e-4
    assert np.linalg.norm(pushed.point - alone.point) > 1e-3


def test_a_way_beside_the_body_finds_no_surface(small_balloon: Balloon) -> None:
    with pytest.raises(BodyError, match="found no surface on its way in"):
        touch_down(small_balloon, np.array([0.2, 0.11, 0.0]), np.array([-1.0, 0.0, 0.0]), NOBODY)


def test_friction_that_is_needed_is_the_slope_of_the_force(balloon: Balloon) -> None:
    found = solve_sticking(balloon, [hand(balloon, 0.0, 0.015, 0.004)])
    n, f = found.normal[0], found.force[0]
    assert np.linalg.norm(n) == pytest.approx(1.0)
    # Nobody else moves the surface, so its normal is that at rest.
    assert n == pytest.approx(out(0.0), abs=0.02)
    slope = np.linalg.norm(f - (f @ n) * n) / (f @ n)
    assert found.friction_needed[0] == pytest.approx(slope)
    assert slope > 0.3


def test_nobody_is_in_equilibrium(small_balloon: Balloon) -> None:
    found = solve_sticking(small_balloon, [])
    assert found.force.shape == (0, 3)
    assert found.response is None
