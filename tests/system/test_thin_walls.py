"""Hands on a wall that gives way as a whole, pressed deeper than it is thick."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cohaptic.simulated.delay_line import LinkSettings
from cohaptic_experiments.virtual_session import VirtualSession
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.testing.blocks import block
from cohaptic_server.world.equilibrium import RestingHand, solve
from cohaptic_tools.demo.lateness import LEAST
from cohaptic_tools.demo.places import place_hands
from cohaptic_tools.demo.scene import Scene, reference
from cohaptic_tools.demo.settled import Placement

THICKNESS = 0.004  # m
YOUNG = 200e3  # Pa; where hands stand it gives way at some 30 N/m


@pytest.fixture(scope="module")
def wall() -> Solid:
    tets = block((0.1, THICKNESS, 0.1), (10, 1, 10))
    settings = SolidSettings(young=YOUNG, order=2, contact_radius=0.01)
    return Solid(tets, tets.vertices[:, 2] <= 0.0, settings)


@pytest.fixture(scope="module")
def placement(wall: Solid) -> Placement:
    return place_hands(wall, wall.shape.held, 2)


@pytest.mark.parametrize("depth", [0.001, 0.003, 0.006, 0.01])
def test_a_hand_touches_the_side_that_it_came_to(wall: Solid, depth: float) -> None:
    """A spring in a row with the wall's, from a fraction of the thickness to several of it."""
    stiffness, half = 400.0, 0.5 * THICKNESS
    start, intention = (0.0, -half - 0.01, 0.06), (0.0, -half + depth, 0.06)
    found = solve(wall, [RestingHand(intention, stiffness, start)])
    assert found.place[0, 1] == pytest.approx(-half, abs=1e-6)
    expected = depth / (found.compliance[0, 0] + 1.0 / stiffness)
    assert found.force[0] == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("delay", [0.0, 0.25])
def test_a_session_finds_the_forces_of_the_reference(
    wall: Solid, placement: Placement, delay: float
) -> None:
    scene = Scene(2, LinkSettings(delay), places=placement.places, depth=placement.depth)
    expected = reference(scene, wall, pressed=True)
    session = VirtualSession(wall, scene.simulation_hz)
    for k, name in enumerate(scene.names):
        script = replace(scene.script(k), approach_at=1.0, rhythm=None)
        session.join(name, script, delay=delay, seed=k, geometry="mesh", law=scene.law)
    # The contacts creep along the wall as it tilts, by a part of the way in each round trip.
    session.run(5.0 + 20.0 * delay)
    force = np.array([user.force[-1] for user in session.users.values()])
    assert force == pytest.approx(expected.force, abs=0.02 * LEAST + 0.01 * expected.force.max())
